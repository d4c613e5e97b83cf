"""Alarms without a service: each run that has ended by itself is told once, by whom it may be, and nothing waits."""

import json
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

import pytest

from jointlab.alarms import alone, deliverer
from jointlab.alarms.alone import Alone
from jointlab.alarms.settings import AlarmSettings
from jointlab.alarms.unstored import sending
from jointlab.alarms.webhook import Webhook
from jointlab.client import Client
from jointlab.drive.process import AlarmProcess
from rig.runs.records import EndRecord, RunOrder
from rig.runs.spool import discard_spool, spooling, spools
from rig.sequences.sequence import sequence_from
from simlab.laboratory import Laboratory
from store.states import RunState
from tests.api.commands.test_service import serving_process
from tests.api.conftest import paper
from tests.jointlab.alarms.receivers import Received
from tests.jointlab.alarms.test_killed_processes import folder, laboratory, measure, running_laboratory
from tests.waiting import until

__all__ = ["folder", "laboratory", "running_laboratory"]
Start = Callable[..., Alone]


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pauses of a hundredth."""
    monkeypatch.setattr(alone, "POLL", alone.POLL / 100)
    monkeypatch.setattr(deliverer, "FIRST_PAUSE", deliverer.FIRST_PAUSE / 100)


@pytest.fixture
def start(tmp_path: Path, receiver: Received) -> Iterator[Start]:
    """Tell while nobody steers the rig, or while somebody does."""
    started = list[Alone]()

    def begin(*, is_alone: bool = True) -> Alone:
        event = threading.Event()
        if is_alone:
            event.set()
        started.append(Alone(tmp_path, "rig", AlarmSettings(), (Webhook(receiver.url, None, 1.0),), event))
        return started[-1]

    yield begin
    for each in started:
        each.close()


def spool(folder: Path, run: int = 1, *, by_itself: bool = True) -> Path:
    """The spool of a run that has ended, which no service has stored."""
    order = RunOrder(run, f"run-{run}-of-test", sequence_from(paper()).with_seed(), "test")
    with spooling(folder / "spools", order) as records:
        records.write(EndRecord(datetime.now(UTC), "test", RunState.FAILED, "the pump stopped", by_itself))
    return max(spools(folder / "spools"), key=lambda path: path.stat().st_mtime_ns)


def test_it_tells_once_of_each_run_that_has_ended_by_itself(tmp_path: Path, receiver: Received, start: Start) -> None:
    spool(tmp_path, 1)
    spool(tmp_path, 2, by_itself=False)
    first = start()
    until(lambda: len(receiver.bodies) == 1)
    spool(tmp_path, 3)
    until(lambda: len(receiver.bodies) == 2)
    first.finish()
    first.close()
    start().finish()  # of a drive process that is started again
    spool(tmp_path, 4)
    until(lambda: len(receiver.bodies) == 3)
    assert [json.loads(body)["run"] for body in receiver.bodies] == [1, 3, 4]
    assert "on rig has failed: the pump stopped" in json.loads(receiver.bodies[0])["text"]


def test_it_tries_again_until_it_is_delivered(tmp_path: Path, receiver: Received, start: Start) -> None:
    receiver.statuses = [500, 503, 200]
    spool(tmp_path)
    start()
    until(lambda: len(receiver.bodies) == 3)
    assert len(set(receiver.bodies)) == 1


def test_it_tells_of_a_run_that_ends_at_the_same_moment_as_the_drive_process(
    tmp_path: Path, receiver: Received, start: Start
) -> None:
    alone = start()
    until(lambda: alone._looks > 0)
    spool(tmp_path)
    alone.finish()
    assert len(receiver.bodies) == 1


def test_it_tells_nothing_while_a_program_steers_or_of_what_a_service_has_stored(
    tmp_path: Path, receiver: Received, start: Start
) -> None:
    kept = spool(tmp_path)
    with closing(start(is_alone=False)) as quiet:
        quiet.finish()
    with sending(tmp_path, "webhook"):  # as a service does, after it has stored the alarm
        waiting = start()
        until(lambda: bool(waiting.standing()))
        discard_spool(kept)
    until(lambda: not waiting.standing())
    assert not receiver.bodies


def test_nothing_waits_for_one_that_hangs(tmp_path: Path) -> None:
    alarm_process = AlarmProcess(tmp_path, "rig")
    with alarm_process.process:
        alarm_process.process.send_signal(signal.SIGSTOP)
        for number in range(100_000):  # more than the pipe takes
            alarm_process.set_alone(bool(number % 2))
        alarm_process.process.kill()
        alarm_process.process.wait()
        alarm_process.set_alone(True)


def test_a_run_that_ends_while_no_service_is_there_is_told_at_once_and_not_again_by_the_next_service(
    laboratory: Laboratory, folder: Path, receiver: Received
) -> None:
    with serving_process(folder) as (address, process):
        with Client(address) as lab:
            run = measure(lab, laboratory)
        process.kill()
    laboratory.tester.emergency_stop()
    until(lambda: bool(receiver.bodies))
    found = json.loads(receiver.bodies[0])
    assert (found["kind"], found["run"]) == ("run_ended", run)
    assert "emergency stop" in found["text"]
    with serving_process(folder) as (address, _), Client(address) as lab:
        until(lambda: any(alarm.deliveries and alarm.deliveries[0].delivered_at for alarm in lab.alarms()))
        (alarm,) = lab.alarms()
    assert alarm.uid == found["id"]
    assert len(receiver.bodies) == 1
