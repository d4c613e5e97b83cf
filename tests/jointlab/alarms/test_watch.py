"""What is watched: a run that lost its process, a database that is away while a run goes on, a frozen drive process."""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

import pytest

from jointlab.alarms import watch
from jointlab.alarms.settings import AlarmSettings
from jointlab.alarms.unstored import UnstoredAlarms
from jointlab.alarms.watch import AlarmWatch
from jointlab.drive.endpoint import NoDriveError
from jointlab.drive.events import RunEnded
from jointlab.drive.phase import Phase
from jointlab.drive.state import RigState, after
from jointlab.runs.ingest import Ingester
from jointlab.runs.orders import order_to_begin, order_to_resume, plan_run
from jointlab.supervision.manager import RunManager
from rig.events import ActuatorShutDown, InterlockReset, InterlockTripped, RestUnknown
from rig.registers import NO_INTERLOCK, Interlock
from rig.runs.records import BeginRecord, RunOrder
from rig.runs.spool import spooling
from rig.sequences.sequence import sequence_from
from rig.tester.limits import TesterLimits
from store.catalogue import Catalogue
from store.service.alarms import NewAlarm, acknowledge_alarm, list_alarms
from store.service.jobs import add_job, fail_job, take_job
from store.states import AlarmKind, RunState
from tests.fault_proxy import FaultProxy, Impairment, Way
from tests.jointlab.runs.campaign import STARTED
from tests.rig.conftest import DOCUMENT
from tests.waiting import until


@dataclass
class Rig:
    """What the watch knows of a rig."""

    state: RigState = field(default_factory=RigState)
    records_wait: str | None = None
    silent: bool = False

    def check_drive(self, timeout: float) -> None:
        if self.silent:
            raise NoDriveError(f"no answer within {timeout} s")


@pytest.fixture
def rig() -> Rig:
    return Rig()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Of the spools."""
    return tmp_path / "spools"


Watch = Callable[..., AlarmWatch]


@pytest.fixture
def watching(tmp_path: Path, rig: Rig, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Watch]:
    """Start watches, which are closed in the end."""
    monkeypatch.setattr(watch, "POLL", 0.02)
    with ExitStack() as stack:

        def start(catalogue: Catalogue, **settings: object) -> AlarmWatch:
            unstored = UnstoredAlarms(tmp_path / "alarms.json")
            given = AlarmSettings.model_validate(settings)
            started = AlarmWatch(catalogue, "rig", cast(RunManager, rig), given, unstored, [folder])
            stack.callback(started.close)
            return started

        yield start


@contextmanager
def carried_out(catalogue: Catalogue, folder: Path, order: RunOrder) -> Iterator[None]:
    """A process that has begun with the run, and is killed in the end."""
    with spooling(folder, order) as spool:
        spool.write(BeginRecord(STARTED, "ann@rig", (), (), "it goes on" if order.begun_with else None))
        with Ingester(catalogue, folder) as ingester:
            assert ingester.settle()
        yield
    with Ingester(catalogue, folder) as ingester:
        assert ingester.settle()


def kinds(found: AlarmWatch) -> list[AlarmKind]:
    found.look()
    return [alarm.kind for alarm in found.standing]


def test_a_run_whose_process_died_is_an_alarm_each_time_also_of_a_service_that_comes_later(
    catalogue: Catalogue, folder: Path, watching: Watch
) -> None:
    run = plan_run(sequence_from(DOCUMENT), TesterLimits(), catalogue, "test", rig="rig")
    plan_run(sequence_from(DOCUMENT), TesterLimits(), catalogue, "test", rig="rig")  # for later
    first = watching(catalogue)
    with carried_out(catalogue, folder, order_to_begin(run, rig="rig")):
        assert kinds(first) == []
    assert kinds(first) == [AlarmKind.RUN_CUT_OFF]
    (alarm,) = first.standing
    assert (alarm.run_id, alarm.text) == (
        run.id, f"run {run.id} ({run.title}) on rig was cut off: nothing carries it out any more",
    )  # fmt: skip
    assert kinds(watching(catalogue)) == [AlarmKind.RUN_CUT_OFF]
    with catalogue.writing() as session:
        acknowledge_alarm(session, list_alarms(session)[0].id, "ann")
    assert kinds(first) == []
    with carried_out(catalogue, folder, order_to_resume(catalogue, run.id, TesterLimits(), rig="rig")):
        assert kinds(first) == []
    until(lambda: kinds(first) == [AlarmKind.RUN_CUT_OFF])  # two watches may get in the way of each other once


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_a_database_that_is_away_while_a_run_goes_on_is_an_alarm_that_needs_no_database(
    distant_url: str, proxy: FaultProxy, tmp_path: Path, rig: Rig, watching: Watch
) -> None:
    with Catalogue.open(distant_url, tmp_path / "waveforms") as catalogue:
        found = watching(catalogue, database_away=1)
        assert kinds(found) == []
        proxy.impair(Impairment(reset=Way.BOTH))
        time.sleep(1.5)  # longer than it may be away
        assert kinds(found) == []  # while nothing is measured
        rig.state = RigState(Phase.RUNNING, 7)
        until(lambda: [alarm.kind for alarm in found.standing] == [AlarmKind.DATABASE_AWAY])
        until(lambda: list(UnstoredAlarms(tmp_path / "alarms.json").alarms) == list(found.standing))  # a kill now
        kept = list(found.standing)
        proxy.repair()
        until(lambda: stored(catalogue) == kept)
        assert kinds(found) == [AlarmKind.DATABASE_AWAY]  # one, and it stands until somebody has seen it
        assert UnstoredAlarms(tmp_path / "alarms.json").alarms == ()


def stored(catalogue: Catalogue) -> list[NewAlarm]:
    with catalogue.reading() as session:
        alarms = list_alarms(session)
    return [NewAlarm(**{name: getattr(each, name) for name in NewAlarm.__dataclass_fields__}) for each in alarms]


def test_records_that_cannot_be_stored_are_an_alarm_also_when_the_run_has_ended_meanwhile(
    catalogue: Catalogue, rig: Rig, watching: Watch
) -> None:
    found = watching(catalogue, database_away=1)
    rig.records_wait = "the waveforms cannot be written"
    until(lambda: bool(found.standing))
    assert "the waveforms cannot be written" in found.standing[0].text


def test_a_drive_process_that_gives_no_sign_of_life_during_a_run_is_an_alarm(
    catalogue: Catalogue, rig: Rig, watching: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watch, "DRIVE_SILENT", 0.1)
    found = watching(catalogue)
    rig.silent = True
    assert kinds(found) == []  # nothing is carried out
    rig.state = RigState(Phase.RUNNING, 7)
    until(lambda: kinds(found) == [AlarmKind.DRIVE_SILENT])
    assert "run 7" in found.standing[0].text
    until(lambda: len(stored(catalogue)) == 1)
    with catalogue.writing() as session:
        acknowledge_alarm(session, list_alarms(session)[0].id, "ann")
    for _ in range(3):
        assert kinds(found) == []  # it is still silent, and somebody knows


def test_a_drive_process_that_is_lost_during_a_run_is_an_alarm_although_its_phase_is_not_known_any_more(
    catalogue: Catalogue, rig: Rig, watching: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watch, "DRIVE_SILENT", 0.1)
    rig.state = RigState(Phase.RUNNING, 7)
    found = watching(catalogue)
    assert kinds(found) == []
    rig.state, rig.silent = RigState(Phase.UNKNOWN, 7, tester_silent="no drive process answers"), True
    until(lambda: kinds(found) == [AlarmKind.DRIVE_SILENT])
    assert "run 7" in found.standing[0].text


def test_a_run_that_does_not_end_without_its_actuator_is_told_as_stopping_and_is_an_alarm(
    catalogue: Catalogue, rig: Rig, watching: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watch, "STUCK", 0.1)
    found = watching(catalogue)
    rig.state = after(RigState(Phase.RUNNING, 7), ActuatorShutDown("the disk has not taken a sine point"))
    assert (rig.state.phase, rig.state.activity) == (
        Phase.STOPPING, "the actuator is shut down: the disk has not taken a sine point"
    )  # fmt: skip
    until(lambda: kinds(found) == [AlarmKind.RUN_STUCK])
    assert found.standing[0].text == (
        "run 7 on rig does not end, although its actuator is shut down: the disk has not taken a sine point"
    )
    ended = after(rig.state, RunEnded(7, RunState.FAILED, "the disk has not taken a sine point"))
    assert (ended.phase, ended.shut_down) == (Phase.IDLE, None)


def test_a_run_that_does_not_end_and_left_its_actuator_unconfirmed_is_told_as_stopping_and_is_an_alarm(
    catalogue: Catalogue, rig: Rig, watching: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watch, "STUCK", 0.1)
    found = watching(catalogue)
    rig.state = after(RigState(Phase.RUNNING, 7), RestUnknown("it has no watchdog: press the red button"))
    assert (rig.state.phase, rig.state.rest_unknown) == (Phase.STOPPING, "it has no watchdog: press the red button")
    until(lambda: kinds(found) == [AlarmKind.RUN_STUCK])
    assert found.standing[0].text == (
        "run 7 on rig does not end, and its actuator was not confirmed at rest: it has no watchdog: press the red "
        "button"
    )


@pytest.mark.parametrize(
    ("interlocks", "said"),
    [(Interlock.EMERGENCY_STOP, "emergency stop"), (NO_INTERLOCK, "something that it does not name")],
)
def test_a_trip_while_no_run_is_carried_out_is_one_alarm_also_for_the_next_service(
    catalogue: Catalogue, rig: Rig, watching: Watch, interlocks: Interlock, said: str
) -> None:
    rig.state = after(RigState(), InterlockTripped(interlocks, stopped=True))
    found = watching(catalogue)
    until(lambda: kinds(found) == [AlarmKind.TESTER_TRIPPED])
    assert found.standing[0].text == f"the tester of rig was stopped by {said} while no run was carried out"
    until(lambda: len(stored(catalogue)) == 1)
    found.close()
    after_restart = watching(catalogue)
    for _ in range(3):
        assert kinds(after_restart) == [AlarmKind.TESTER_TRIPPED]


def test_a_tester_that_was_reset_and_trips_again_is_a_further_alarm_although_nobody_has_seen_the_first(
    catalogue: Catalogue, rig: Rig, watching: Watch
) -> None:
    tripped = after(RigState(), InterlockTripped(Interlock.FORCE, stopped=True))
    lost = RigState(Phase.UNKNOWN, tester_silent="no drive process answers")
    not_read = RigState(tester_silent="it was not read since the drive process began")
    found = watching(catalogue)
    for state in (tripped, lost, not_read, tripped):  # another drive process finds the trip again
        rig.state = state
        until(lambda: kinds(found) == [AlarmKind.TESTER_TRIPPED])
    rig.state = after(tripped, InterlockReset(Interlock.FORCE))
    assert kinds(found) == [AlarmKind.TESTER_TRIPPED]
    rig.state = tripped
    assert kinds(found) == [AlarmKind.TESTER_TRIPPED] * 2


def test_a_trip_while_a_run_waits_is_an_alarm_where_the_run_goes_on_waiting(
    catalogue: Catalogue, rig: Rig, watching: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = watching(catalogue)
    rig.state = after(RigState(Phase.RUNNING, 7), InterlockTripped(Interlock.FORCE, stopped=True))
    assert kinds(found) == []  # it may end by that, which is told
    monkeypatch.setattr(watch, "STUCK", 0.1)
    until(lambda: kinds(found) == [AlarmKind.TESTER_TRIPPED])
    assert found.standing[0].text == "the tester of rig was stopped by force limit while run 7 waits"


def test_a_trip_that_ends_a_run_is_told_by_the_end_of_the_run_alone(
    catalogue: Catalogue, rig: Rig, watching: Watch
) -> None:
    found = watching(catalogue)
    tripped = after(RigState(Phase.RUNNING, 7), InterlockTripped(Interlock.FORCE, stopped=True))
    rig.state = after(tripped, RunEnded(7, RunState.FAILED, "force"))
    for _ in range(3):
        assert kinds(found) == []


@pytest.mark.parametrize("asked", [True, False])
def test_a_failed_job_is_an_alarm_where_that_is_asked_for(catalogue: Catalogue, watching: Watch, asked: bool) -> None:
    with catalogue.writing() as session:
        add_job(session, "identify", {"run": 1}, "ann")
        taken = take_job(session, ["identify"])
        assert taken is not None
        fail_job(session, taken[0].id, taken[1], "no blow counts")
    found = watching(catalogue, failed_jobs=asked)
    assert kinds(found) == [AlarmKind.JOB_FAILED] * asked
    assert kinds(found) == [AlarmKind.JOB_FAILED] * asked
    assert all("asked for by ann: no blow counts" in alarm.text for alarm in found.standing)
