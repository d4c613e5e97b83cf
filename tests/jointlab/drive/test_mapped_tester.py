"""A rig whose tester has other registers: its drive process, and STOP."""

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from api.page.frame import badge_of
from api.page.views.hall import state_text
from jointlab.drive.phase import Phase
from jointlab.drive.process import Drive
from jointlab.drive.protocol import Acknowledge, End
from jointlab.hall import Seen, state_of
from jointlab.instruments import instruments_of
from jointlab.settings import DriveSettings, HallRig, Settings
from jointlab.supervision.drive_link import NEEDED, DriveLink
from jointlab.trials.simulated_laboratory import simulated_settings
from rig.errors import RigError
from rig.registers import State
from rig.runs.records import RunOrder
from rig.tester.missing_functions import Lack
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from simlab.plc_tester import PlcFault, PlcTesterServer
from simlab.tester_server import TesterFault
from store.states import RunState
from tests.api.conftest import SPEED
from tests.jointlab.drive.conftest import Heard, Kept, begin
from tests.rig.mapped import EXAMPLE
from tests.waiting import LONG, until


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


def repair_tester(plc: PlcTesterServer) -> None:
    plc.faults.clear()
    plc.release_emergency_stop()


def test_stop_brings_a_sweep_on_other_registers_to_rest(
    drive: Drive, link: DriveLink, heard: Heard, kept: Kept, order: RunOrder, hand: OperatorClient, plc: PlcTesterServer
) -> None:
    begin(link, heard, order, link.take_lease("test"))
    until(lambda: bool(kept.sines))
    assert httpx.post(f"http://127.0.0.1:{drive.listener.port}/stop").json()["at_rest"] is True
    assert heard.end() is RunState.STOPPED
    assert plc.device.status()["state"] == State.HYDRAULICS_OFF


def test_a_tester_that_obeys_no_stop_is_told_as_at_rest_by_nobody_until_it_was_read(
    drive: Drive, link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient, plc: PlcTesterServer
) -> None:
    lease = link.take_lease("test")
    begin(link, heard, order, lease)
    plc.faults.set(PlcFault.IGNORE)
    plc.faults.set(TesterFault.DEAD_EMERGENCY_STOP)
    with pytest.raises(RigError, match="not confirmed at rest"):
        link.ask(End(run_id=1), LONG)
    until(lambda: heard.now.state.ended_as is not None)
    assert plc.device.is_moving()
    assert (heard.now.state.phase, badge_of(heard.now.state)) == (Phase.IDLE, ("rest not confirmed", "tripped"))
    given = HallRig(rig="rig under test", stop_address="127.0.0.1", stop_port=drive.listener.port)
    reported = state_of(given)
    assert "press the red button" in (reported.rest_unknown or "")
    assert "rest not confirmed" in state_text(Seen(given, reported, "", None))
    plc.emergency_stop()
    until(lambda: heard.now.state.rest_unknown is None)
    assert badge_of(heard.now.state) == ("tripped: emergency stop", "tripped")
    assert "RestSeen" in heard.names[-2:]
    repair_tester(plc)
    link.ask(Acknowledge(lease=lease), LONG)
    assert badge_of(heard.now.state)[0] == "at rest"


def test_motion_that_another_client_begins_while_nothing_is_carried_out_is_told(
    drive: Drive, heard: Heard, link: DriveLink, laboratory: Laboratory, drive_settings: Settings
) -> None:
    found = instruments_of(drive_settings)
    with found.tester() as other:
        other.start()
        other.preset(5e-4)
        other.cycle(1e-4, 20.0)
        until(lambda: heard.now.state.rest_unknown is not None)
        assert "although no run is in progress" in (heard.now.state.rest_unknown or "")
    until(lambda: heard.now.state.rest_unknown is None)


def test_a_drive_process_of_its_own_gets_the_map_and_what_was_accepted(drive_settings: Settings) -> None:
    given = Settings.model_validate_json(drive_settings.model_dump_json(include=NEEDED))
    assert (given.tester_map, given.tester_without) == (drive_settings.tester_map, (Lack.WATCHDOG,))


@pytest.fixture
def nameless(drive_settings: Settings) -> None:
    """The map does not say what its interlocks are."""
    assert drive_settings.tester_map is not None
    before, _, after = drive_settings.tester_map.read_text(encoding="utf-8").partition("[interlocks]")
    others = after[after.index("\n[") :] if "\n[" in after else ""
    drive_settings.tester_map.write_text(before + others, encoding="utf-8")


@pytest.mark.usefixtures("nameless")
def test_a_trip_that_the_tester_does_not_name_is_told_while_nothing_is_carried_out(
    drive: Drive, link: DriveLink, heard: Heard, plc: PlcTesterServer
) -> None:
    plc.device.emergency_stop()
    until(lambda: heard.now.state.is_tripped)
    assert heard.now.state.unnamed_trip
    assert badge_of(heard.now.state) == ("tripped: it does not name why", "tripped")
    given = HallRig(rig="rig under test", stop_address="127.0.0.1", stop_port=drive.listener.port)
    assert "tripped: it does not name why" in state_text(Seen(given, state_of(given), "", None))
    plc.release_emergency_stop()
    link.ask(Acknowledge(lease=link.take_lease("test")))
    until(lambda: not heard.now.state.is_tripped)
