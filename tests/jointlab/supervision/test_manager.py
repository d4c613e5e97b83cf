"""The run manager: STOP and pause wait for no other request, and STOP halts the tester whichever client moves it."""

import math
import signal
import sqlite3
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx
import pytest

from api.service import deadlines
from api.service.application import THREADS, create_app
from api.service.context import Services
from jointlab.drive import server as drive_server
from jointlab.drive.phase import Phase
from jointlab.errors import ConflictError
from jointlab.settings import Settings
from jointlab.supervision import drive_mirror, lease
from jointlab.supervision.drive_mirror import DriveMirror
from jointlab.supervision.manager import RunManager
from jointlab.trials.simulated_operator import SimulatedOperator
from rig.errors import RigError
from rig.registers import Interlock, State
from rig.runs import run as rig_run
from rig.sequences.sequence import sequence_from
from rig.tester.driver import connect
from rig.tester.limits import TesterLimits
from rig.tester.status import TesterTrippedError
from rig.tester.stop_latch import LeaseLostError
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from store.catalogue import Catalogue
from store.service.audit import list_audit_entries
from store.states import Scope
from tests.api.conftest import paper
from tests.api.service.conftest import make_key_in, managing, served
from tests.ports import free_port
from tests.postgresql_server import NotInstalledError, Server, running_server
from tests.waiting import LONG, until

Acting = Callable[..., dict[str, Any]]
SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [0.1],
    "frequencies": {"first": 20, "last": 200, "step": 0.02},  # longer than any test
}  # fmt: skip


@pytest.fixture
def run(rig: RunManager) -> int:
    return rig.plan(sequence_from(paper() | {"steps": [SWEEP]}), "test")


def measure(rig: RunManager, run: int) -> None:
    """Begin the run, and see it measure."""
    rig.start(run, "test", automatic=True)
    while rig.state.sines < 1:
        assert rig.state.ended_as is None, rig.state.reason
        time.sleep(0.01)


def asked_while_all_threads_wait(
    client: httpx.Client, path: str, headers: dict[str, str], acting: Acting, folder: Path, is_done: Callable[[], bool]
) -> httpx.Response:
    """The answer to a request that is made while the database is locked, and done before the lock ends."""
    with closing(sqlite3.connect(folder / "jointlab.db")) as other, ThreadPoolExecutor(THREADS + 1) as asking:
        other.execute("BEGIN IMMEDIATE")
        waiting = [
            asking.submit(client.post, "/api/runs", json={"sequence": "paper"}, headers=acting())
            for _ in range(THREADS)
        ]
        time.sleep(0.3)  # by now they wait for the database, in every thread that the service has
        asked = asking.submit(client.post, path, headers=headers)
        while not is_done():
            assert not asked.done(), asked.result().text
            time.sleep(0.01)
        assert not any(each.done() for each in (*waiting, asked))
        other.rollback()
    return asked.result()


def test_a_stop_of_a_run_is_done_before_the_database_is_asked_and_a_repeat_gets_its_answer(
    rig_client: httpx.Client, rig: RunManager, run: int, acting: Acting, laboratory: Laboratory, tmp_path: Path
) -> None:
    measure(rig, run)
    path, headers = f"/api/runs/{run}/stop", acting()
    stopped = asked_while_all_threads_wait(
        rig_client, path, headers, acting, tmp_path, lambda: rig.state.phase is Phase.IDLE
    )
    assert laboratory.tester.actuator.steady_pp() == 0.0
    assert (stopped.status_code, stopped.json()["state"]) == (200, "stopped"), stopped.text
    again = rig_client.post(path, headers=headers)
    assert (again.status_code, again.json()) == (200, stopped.json())
    assert again.headers["idempotency-replayed"] == "true"


def test_a_stop_of_a_run_that_cannot_be_noted_says_that_it_was_done(
    impatient: None, rig_client: httpx.Client, rig: RunManager, run: int, acting: Acting, tmp_path: Path
) -> None:
    measure(rig, run)
    with closing(sqlite3.connect(tmp_path / "jointlab.db")) as other:
        other.execute("BEGIN IMMEDIATE")
        answer = rig_client.post(f"/api/runs/{run}/stop", headers=acting())
    assert rig.wait(LONG)
    assert answer.status_code == 503
    assert answer.json()["detail"].startswith(f"run {run} is stopped, with the actuator at rest; but sqlite:")
    assert "another program is writing" in answer.json()["detail"]


def test_a_pause_is_done_before_the_database_is_asked_and_noted_afterwards(
    rig_client: httpx.Client, catalogue: Catalogue, rig: RunManager, run: int, acting: Acting, laboratory: Laboratory,
    tmp_path: Path,
) -> None:  # fmt: skip
    lease = rig_client.post("/api/rig/lease", json={"holder": "test"}, headers=acting()).json()["token"]
    measure(rig, run)
    path, headers = f"/api/runs/{run}/pause", acting(lease=lease)
    paused = asked_while_all_threads_wait(
        rig_client, path, headers, acting, tmp_path, lambda: rig.state.phase is Phase.PAUSED
    )
    assert laboratory.tester.actuator.steady_pp() == 0.0
    assert (paused.status_code, paused.json()["state"]) == (200, "running"), paused.text
    again = rig_client.post(path, headers=headers)
    assert (again.json(), again.headers["idempotency-replayed"]) == (paused.json(), "true")
    noted = [each for each in catalogue.read(list_audit_entries) if each.action == "pause run"]
    assert [(each.target, each.outcome) for each in noted] == [(f"run {run}", "done")]


def test_a_pause_that_cannot_be_noted_says_that_it_was_done(
    impatient: None, rig_client: httpx.Client, rig: RunManager, run: int, acting: Acting, tmp_path: Path
) -> None:
    lease = rig_client.post("/api/rig/lease", json={"holder": "test"}, headers=acting()).json()["token"]
    measure(rig, run)
    with closing(sqlite3.connect(tmp_path / "jointlab.db")) as other:
        other.execute("BEGIN IMMEDIATE")
        answer = rig_client.post(f"/api/runs/{run}/pause", headers=acting(lease=lease))
    assert (answer.status_code, rig.state.phase) == (503, Phase.PAUSED)
    assert answer.json()["detail"].startswith(f"run {run} is paused, with the actuator at rest; but sqlite:")


def test_a_pause_is_refused_to_who_does_not_drive_and_that_is_noted(
    rig_client: httpx.Client, catalogue: Catalogue, rig: RunManager, run: int, acting: Acting
) -> None:
    measure(rig, run)
    answer = rig_client.post(f"/api/runs/{run}/pause", headers=acting(lease="of somebody else"))
    assert (answer.status_code, rig.state.phase) == (409, Phase.RUNNING)
    assert [(each.action, each.outcome) for each in catalogue.read(list_audit_entries)] == [
        ("pause run", "refused: nobody drives the rig; take the control lease first")
    ]


@pytest.fixture
def server() -> Iterator[Server]:
    try:
        with running_server() as running:
            running.execute("CREATE DATABASE {}", "rig")
            yield running
    except NotInstalledError as error:
        pytest.skip(str(error))


@pytest.mark.parametrize(("action", "done"), [("stop", "stopped"), ("pause", "paused")])
def test_a_stop_or_a_pause_of_a_run_does_not_wait_for_a_database_that_is_silent(
    server: Server, rig_settings: Settings, laboratory: Laboratory, acting: Acting, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, action: str, done: str,
) -> None:  # fmt: skip
    with (
        Catalogue.open(server.url("rig"), tmp_path) as catalogue,
        closing(OperatorClient(laboratory.addresses.operator)) as hand,
        managing(catalogue, rig_settings, SimulatedOperator(hand)) as rig,
        served(create_app(Services(catalogue, rig))) as client,
    ):
        run = rig.plan(sequence_from(paper() | {"steps": [SWEEP]}), "test")
        reading, driving = make_key_in(catalogue)(Scope.READ), make_key_in(catalogue)(Scope.CONTROL)
        lease = rig.lease.take("test", "test").token
        measure(rig, run)
        with monkeypatch.context() as patient:  # where it takes too long to say who asks, it is done
            patient.setattr(deadlines, "STOP_LOOKUP", LONG)
            assert client.post(f"/api/runs/{run}/{action}", headers=acting(reading, lease)).status_code == 403
        assert rig.state.phase is Phase.RUNNING
        server.send(signal.SIGSTOP)
        try:
            answer = client.post(f"/api/runs/{run}/{action}", headers=acting(driving, lease))
            assert laboratory.tester.actuator.steady_pp() == 0.0
        finally:
            server.send(signal.SIGCONT)
        assert answer.status_code == 503
        assert answer.json()["detail"].startswith(f"run {run} is {done}, with the actuator at rest; but the database")
        assert f"has not answered within {deadlines.STOP_LOOKUP:g} s" in answer.json()["detail"]
        rig.stop()
        assert rig.wait(LONG)


def test_a_stop_of_another_run_leaves_the_one_that_is_carried_out(
    rig_client: httpx.Client, rig: RunManager, run: int, acting: Acting
) -> None:
    other = rig.plan(sequence_from(paper() | {"steps": [SWEEP]}), "test")
    measure(rig, run)
    refused = rig_client.post(f"/api/runs/{other}/stop", headers=acting())
    assert (refused.status_code, refused.json()["detail"]) == (409, f"run {other} is not being carried out here")
    assert (rig.state.phase, rig.state.run_id) == (Phase.RUNNING, run)


def test_a_stop_waits_for_no_limits_that_are_being_stored(rig: RunManager, run: int, tmp_path: Path) -> None:
    measure(rig, run)
    storing = threading.Thread(target=rig.set_limits, args=(TesterLimits(force=3e3), "test"))
    with closing(sqlite3.connect(tmp_path / "jointlab.db")) as other:
        other.execute("BEGIN IMMEDIATE")
        storing.start()
        time.sleep(0.3)  # by now it waits for the database
        assert rig.stop() == run
        assert storing.is_alive()  # a writer waits ten seconds for a locked database
        other.rollback()
    storing.join()
    assert rig.instruments.limits.force == 3e3


def test_each_of_two_hundred_stops_at_once_is_done(rig: RunManager, run: int, laboratory: Laboratory) -> None:
    measure(rig, run)
    with ThreadPoolExecutor(200) as people:
        stopped = [people.submit(rig.stop, f"person {number}") for number in range(200)]
        assert {future.exception(LONG) for future in stopped} == {None}
    assert laboratory.tester.actuator.steady_pp() == 0.0
    assert rig.stopped_by is not None


def test_a_stop_gets_through_where_other_programs_take_all_places_for_a_moment(
    rig: RunManager, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch, ThreadPoolExecutor(1) as person:
        patch.setattr(drive_server, "CONNECTIONS", 0)  # each connection is dropped
        stopping = person.submit(rig.stop, "a person")
        time.sleep(0.5)
        assert not stopping.done()
        patch.undo()
        assert stopping.exception(LONG) is None


def test_a_stop_halts_a_tester_that_another_client_moves(rig: RunManager, laboratory: Laboratory) -> None:
    with connect(laboratory.addresses.tester) as other:
        other.start()
        other.preset(5e-4)
        other.cycle(1e-4, 50.0)
        assert other.status().state in (State.CYCLING, State.SETTLED)
        assert rig.stop() is None
        assert laboratory.tester.actuator.steady_pp() == 0.0


def test_a_run_that_is_resumed_while_it_is_being_stopped_goes_on_when_it_has_ended(
    rig_client: httpx.Client, rig: RunManager, run: int, acting: Acting, monkeypatch: pytest.MonkeyPatch
) -> None:
    lease = rig_client.post("/api/rig/lease", json={"holder": "test"}, headers=acting()).json()["token"]
    may_end, write_end = threading.Event(), rig_run._end

    def end_later(*given: Any, **named: Any) -> None:
        may_end.wait(LONG)
        write_end(*given, **named)

    rig_client.post(f"/api/runs/{run}/start", json={"automatic": True}, headers=acting(lease=lease))
    until(lambda: rig.state.sines > 0)
    monkeypatch.setattr(rig_run, "_end", end_later)  # as on a slow disk
    rig_client.post("/api/rig/stop")
    assert rig.stopped_by is not None
    rig_client.post("/api/rig/reset-stop", json={"epoch": rig.stopped_by.epoch}, headers=acting(lease=lease))
    monkeypatch.setattr(drive_mirror, "END_TIMEOUT", 0.1)
    refused = rig_client.post(f"/api/runs/{run}/resume", headers=acting(lease=lease))
    assert (refused.status_code, refused.json()["detail"]) == (
        409, f"run {run} is still being stopped; resume it when it has ended",
    )  # fmt: skip
    monkeypatch.setattr(drive_mirror, "END_TIMEOUT", LONG)
    threading.Timer(0.3, may_end.set).start()
    measured = rig.state.sines
    resumed = rig_client.post(f"/api/runs/{run}/resume", headers=acting(lease=lease))
    assert (resumed.status_code, resumed.json()["state"]) == (200, "running"), resumed.text
    until(lambda: rig.state.sines > measured)
    rig.end_run(run)


def test_a_stop_that_no_tester_confirms_is_an_error(catalogue: Catalogue, rig_settings: Settings) -> None:
    port = free_port()
    nowhere = rig_settings.model_copy(update={"tester_url": f"tcp://127.0.0.1:{port}"})
    with managing(catalogue, nowhere) as manager, pytest.raises(RigError, match=rf"127\.0\.0\.1:{port}"):
        manager.stop()


def test_a_rig_without_a_tester_halts_nothing_and_refuses_a_sweep(catalogue: Catalogue, rig_settings: Settings) -> None:
    with managing(catalogue, rig_settings.model_copy(update={"tester_url": None})) as manager:
        run = manager.plan(sequence_from(paper() | {"steps": [SWEEP]}), "test")
        with pytest.raises(RigError, match="this rig has no tester; write tester_url"):
            manager.start(run, "test", automatic=True)
        assert manager.stop() is None
        assert manager.state.tester_silent is None


def test_a_trip_before_a_run_is_known_after_the_first_attempt(
    rig: RunManager, run: int, laboratory: Laboratory
) -> None:
    laboratory.tester.emergency_stop()
    with pytest.raises(TesterTrippedError):
        rig.start(run, "test", automatic=True)
    assert rig.wait(LONG)
    assert rig.state.interlocks == Interlock.EMERGENCY_STOP
    laboratory.tester.release_emergency_stop()
    assert rig.acknowledge_interlocks() == Interlock.EMERGENCY_STOP
    assert not rig.state.interlocks


def test_what_happened_before_a_client_came_is_counted_before_the_client_hears_of_it(
    rig: RunManager, catalogue: Catalogue, rig_settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig.stop()
    before = rig.latest_event()
    assert before > 0
    monkeypatch.setattr(DriveMirror, "_hear", lambda *_: None)  # news that are on their way
    with closing(RunManager(catalogue, rig_settings, starts=False)) as other:
        assert other.journal.latest == 0
        assert other.latest_event() >= before


def test_a_run_that_was_begun_automatically_is_resumed_so_by_another_program(
    catalogue: Catalogue, rig_settings: Settings, laboratory: Laboratory
) -> None:
    with closing(OperatorClient(laboratory.addresses.operator)) as hand:
        operator = SimulatedOperator(hand)
        with managing(catalogue, rig_settings, operator) as begun:
            run = begun.plan(sequence_from(paper() | {"steps": [SWEEP]}), "test")
            measure(begun, run)
            begun.end_run(run)
            assert begun.wait(LONG)
            measured = begun.state.sines
        with managing(catalogue, rig_settings, operator) as another:
            time.sleep(0.1)
            assert another.state.phase is Phase.IDLE  # it moves nothing by itself
            another.resume(run, "test")
            until(lambda: another.state.sines > measured)  # what was to be mounted is
            another.end_run(run)
            assert another.wait(LONG)
            another.resume(run, "test", automatic=False)
            until(lambda: another.prompt is not None)
            another.end_run(run)


@pytest.fixture
def short_leases(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leases of clients end at once."""
    monkeypatch.setattr(lease, "DURATION", 0.0)


def test_a_lease_that_has_ended_by_itself_keeps_no_other_program_from_the_rig(
    short_leases: None, rig: RunManager, catalogue: Catalogue, rig_settings: Settings
) -> None:
    former = rig.lease.take("ann", "key 1").number
    with closing(RunManager(catalogue, rig_settings, name="another", starts=False)) as other:
        until(lambda: can_take(other))
        with pytest.raises(LeaseLostError):
            rig.look("force", former)
        with pytest.raises(ConflictError, match="bob drives the rig from another program"):
            rig.lease.take("ann", "key 1")


def test_what_was_asked_for_with_a_lease_that_has_ended_meanwhile_is_done(short_leases: None, rig: RunManager) -> None:
    former = rig.lease.take("ann", "key 1").number
    until(lambda: rig.lease._token is None)  # given back
    rig.look("force", former)


def test_a_lease_that_ends_during_a_run_is_kept_until_the_run_has_ended(
    short_leases: None, rig: RunManager, run: int, catalogue: Catalogue, rig_settings: Settings,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr(lease, "LOOK", 0.01)
    measure(rig, run)
    rig.lease.take("ann", "key 1")
    with closing(RunManager(catalogue, rig_settings, name="another", starts=False)) as other:
        sines = rig.state.sines
        until(lambda: rig.state.sines > sines + 1)
        assert not can_take(other)
        rig.end_run(run)
        until(lambda: can_take(other))


def can_take(rig: RunManager) -> bool:
    try:
        rig.lease.take("bob", "terminal", lasts=math.inf)
    except ConflictError:
        return False
    return True
