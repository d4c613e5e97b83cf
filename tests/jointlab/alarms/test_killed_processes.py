"""kill -9 of the service and of the drive process: somebody is told all the same, by the service that comes after."""

import json
import os
import signal
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from jointlab.client import Client
from jointlab.documents.alarms import AlarmDocument
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from store.states import AlarmKind
from tests.api.commands.test_service import serving_process
from tests.api.conftest import laboratory, paper, running_laboratory
from tests.drive_holder import drive_process, end_drive_process
from tests.jointlab.alarms.receivers import Received
from tests.waiting import until

__all__ = ["laboratory", "running_laboratory"]
SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [0.1],
    "frequencies": {"first": 20, "last": 200, "step": 1},
}  # fmt: skip


@pytest.fixture
def folder(laboratory: Laboratory, receiver: Received, tmp_path: Path) -> Iterator[Path]:
    """The folder of a service that tells the receiver."""
    with (tmp_path / "jointlab.toml").open("a", encoding="utf-8") as file:
        file.write(f'\n[alarms]\ndeadline = 1\n[alarms.webhook]\nurl = "{receiver.url}"\n')
    yield tmp_path
    end_drive_process(tmp_path)


def measure(lab: Client, laboratory: Laboratory) -> int:
    """Begin a sweep, and see it measure; then stop driving."""
    run = lab.create_run(paper() | {"steps": [SWEEP]}).id
    with lab.driving("test") as driver, closing(OperatorClient(laboratory.addresses.operator)) as hand:
        driver.start(run)
        until(lambda: lab.rig().prompt is not None)
        prompt = lab.rig().prompt
        assert prompt is not None
        hand.do("mount", specimen="I", configuration="shear")
        driver.answer(run, prompt.number)
        until(lambda: lab.rig().sines > 0)
    return run


def told(receiver: Received) -> dict[str, Any]:
    """What the receiver is told, at last."""
    until(lambda: bool(receiver.bodies))
    found: dict[str, Any] = json.loads(receiver.bodies[-1])
    return found


def test_a_run_that_ends_while_no_service_is_there_is_told_by_the_next_ones_until_it_is_delivered(
    laboratory: Laboratory, folder: Path, receiver: Received
) -> None:
    with serving_process(folder) as (address, process):
        with Client(address) as lab:
            run = measure(lab, laboratory)
        process.kill()
    laboratory.tester.emergency_stop()
    receiver.statuses = [500]
    with serving_process(folder) as (_, process):
        first = told(receiver)
        process.kill()
    assert (first["kind"], first["run"]) == ("run_ended", run)
    receiver.bodies.clear()
    receiver.statuses = [200]
    with serving_process(folder) as (address, _), Client(address) as lab:

        def alarm() -> AlarmDocument:
            # a drive process that begins long after the run sees the trip, and tells that, too
            (found,) = [each for each in lab.alarms() if each.kind is AlarmKind.RUN_ENDED]
            return found

        until(lambda: any(each.delivered_at for each in alarm().deliveries))
        assert alarm().uid == first["id"]
        assert alarm().acknowledged_at is None
    assert [found for found in map(json.loads, receiver.bodies) if found["kind"] == "run_ended"] == [first]


def test_a_drive_process_that_is_killed_during_a_run_is_told(
    laboratory: Laboratory, folder: Path, receiver: Received
) -> None:
    with serving_process(folder) as (address, _), Client(address) as lab:
        run = measure(lab, laboratory)
        os.kill(drive_process(folder), signal.SIGKILL)
        found = told(receiver)
        assert (found["kind"], found["run"]) == ("run_cut_off", run)
        assert len(list(lab.alarms())) == 1
