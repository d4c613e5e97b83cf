"""A rig whose tester has other registers: its drive process, and STOP."""

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from jointlab.drive.process import Drive
from jointlab.settings import DriveSettings, Settings
from jointlab.supervision.drive_link import NEEDED, DriveLink
from jointlab.trials.simulated_laboratory import simulated_settings
from rig.registers import State
from rig.runs.records import RunOrder
from rig.tester.missing_functions import Lack
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from simlab.plc_tester import PlcTesterServer
from store.states import RunState
from tests.api.conftest import SPEED
from tests.jointlab.drive.conftest import Heard, Kept
from tests.jointlab.drive.test_rig import begin
from tests.rig.mapped import EXAMPLE
from tests.waiting import until


@pytest.fixture(scope="module")
def running_laboratory() -> Iterator[Laboratory]:
    with Laboratory(3, SPEED, other_tester=True) as laboratory:
        yield laboratory


@pytest.fixture
def plc(laboratory: Laboratory) -> PlcTesterServer:
    server = laboratory.tester
    assert isinstance(server, PlcTesterServer)
    server.has_watchdog = False
    return server


@pytest.fixture
def drive_settings(laboratory: Laboratory, plc: PlcTesterServer, tmp_path: Path) -> Settings:
    without = EXAMPLE.read_text(encoding="utf-8").partition("[heartbeat]")[0]
    (tmp_path / "map.toml").write_text(without, encoding="utf-8")
    found = simulated_settings(
        laboratory.addresses, drive=DriveSettings(folder=tmp_path / "drive", stop_port=0), rig="rig under test"
    )
    mapped = {"tester_map": tmp_path / "map.toml", "tester_without": (Lack.WATCHDOG,)}
    return found.model_copy(update=mapped)


def test_stop_brings_a_sweep_on_other_registers_to_rest(
    drive: Drive, link: DriveLink, heard: Heard, kept: Kept, order: RunOrder, hand: OperatorClient, plc: PlcTesterServer
) -> None:
    begin(link, heard, order, link.take_lease("test"))
    until(lambda: bool(kept.sines))
    assert httpx.post(f"http://127.0.0.1:{drive.listener.port}/stop").json()["at_rest"] is True
    until(lambda: heard.now.state.ended_as is RunState.STOPPED)
    assert plc.device.status()["state"] == State.HYDRAULICS_OFF


def test_a_drive_process_of_its_own_gets_the_map_and_what_was_accepted(drive_settings: Settings) -> None:
    given = Settings.model_validate_json(drive_settings.model_dump_json(include=NEEDED))
    assert (given.tester_map, given.tester_without) == (drive_settings.tester_map, (Lack.WATCHDOG,))
