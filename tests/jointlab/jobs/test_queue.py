"""Jobs in processes: done once, taken up again when a worker is killed, cancelled when that is asked for."""

import os
import signal
import sqlite3
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from dataclasses import replace
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import text
from sqlalchemy.orm import Session

from jointlab.errors import ConflictError, JointlabError
from jointlab.jobs.executors import ProcessExecutor
from jointlab.jobs.kinds import KINDS, exports_folder
from jointlab.jobs.limits import JobLimits, QuotaError, remove_old_exports
from jointlab.jobs.queue import JobQueue
from jointlab.jobs.work import carry_out
from store.catalogue import Catalogue, CatalogueParts
from store.database.time_limits import DEFAULT_LIMITS, TimeLimits
from store.errors import StoreError
from store.service.jobs import MOST_ATTEMPTS, add_job, lose_job, take_job
from store.service.requests import begin_request, find_request, remove_old_requests
from store.states import JobState
from tests.databases import is_waiting
from tests.jointlab.jobs.conftest import QUICK, Wait
from tests.postgresql_server import Server
from tests.waiting import LONG, until


@pytest.fixture
def executor() -> ProcessExecutor:
    return ProcessExecutor(workers=1)


@pytest.fixture
def queue(catalogue: Catalogue, executor: ProcessExecutor) -> Iterator[JobQueue]:
    made = JobQueue(catalogue, executor)
    yield made
    made.close()


class Full(ProcessExecutor):
    """Has no room for anything."""

    def has_room(self, beyond: int = 0) -> bool:
        return False


class Holding(ProcessExecutor):
    """Begins jobs that never end."""

    def __init__(self) -> None:
        super().__init__(workers=1)
        self.begun = dict[int, str]()

    def has_room(self, beyond: int = 0) -> bool:
        return len(self.begun) < 1 + beyond

    def begin(self, place: CatalogueParts, job_id: int, token: str) -> None:
        self.begun[job_id] = token

    def drop(self, job_id: int) -> None:
        self.begun.pop(job_id, None)

    def has_begun(self, job_id: int) -> bool:
        return job_id in self.begun


@pytest.fixture
def idle(catalogue: Catalogue) -> Iterator[JobQueue]:
    """A queue that begins nothing, with three jobs for a caller."""
    made = JobQueue(catalogue, Full(), JobLimits(open_jobs=3))
    yield made
    made.close()


def analyses(catalogue: Catalogue) -> int:
    with catalogue.reading() as session:
        return int(session.scalar(text("SELECT count(*) FROM analyses")) or 0)


def test_the_job_of_a_killed_worker_is_taken_up_again_and_has_one_result(
    catalogue: Catalogue, queue: JobQueue, executor: ProcessExecutor, wait_for: Wait
) -> None:
    before = analyses(catalogue)
    job = queue.add("identify", QUICK, "test")
    wait_for(job, lambda found: found.stage is not None)  # it is at work
    pid = executor._processes[job.id][0].pid
    assert pid is not None
    os.kill(pid, signal.SIGKILL)
    done = wait_for(job)
    assert (done.state, done.attempts, done.error) == (JobState.DONE, 2, None)
    assert done.result is not None
    assert {"modes", "paper_joints", "likelihood_joints", "dynamic_stiffness", "comparisons"} <= set(done.result)
    assert analyses(catalogue) - before == len([number for number in done.result.values() if number is not None]) >= 6


class Faltering(ProcessExecutor):
    """The first process cannot be begun, as where the computer has none left."""

    faltered = False

    def begin(self, place: CatalogueParts, job_id: int, token: str) -> None:
        if not self.faltered:
            self.faltered = True
            raise OSError("no more processes")
        super().begin(place, job_id, token)


def test_a_worker_that_cannot_be_begun_costs_an_attempt_and_not_the_queue(catalogue: Catalogue, wait_for: Wait) -> None:
    queue = JobQueue(catalogue, Faltering(workers=1))
    try:
        done = wait_for(queue.add("export", {"run": 1, "form": "hdf5"}, "test"))
    finally:
        queue.close()
    assert (done.state, done.attempts) == (JobState.DONE, 2)


def test_a_worker_waits_for_a_locked_database_as_long_as_the_settings_say(measured: int, tmp_path: Path) -> None:
    limits = TimeLimits(lock=0.05)
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}", limits=limits) as catalogue:
        with catalogue.writing() as session:
            job = add_job(session, "export", {"run": measured, "form": "hdf5"}, "test")
        with closing(sqlite3.connect(tmp_path / "jointlab.db")) as other:
            other.execute("BEGIN IMMEDIATE")
            began = time.monotonic()
            with pytest.raises(StoreError, match="lock"):
                carry_out(catalogue.place, job.id, "token")
            assert time.monotonic() - began < DEFAULT_LIMITS.lock / 2


def test_a_worker_that_hangs_makes_room_for_another(
    catalogue: Catalogue, queue: JobQueue, executor: ProcessExecutor, wait_for: Wait, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("jointlab.jobs.queue.STALE_CHECK", 0.2)
    job = queue.add("identify", QUICK, "test")
    wait_for(job, lambda found: found.stage is not None)
    pid = executor._processes[job.id][0].pid
    assert pid is not None
    os.kill(pid, signal.SIGSTOP)
    monkeypatch.setattr("jointlab.jobs.queue.LEASE", timedelta(seconds=5))
    wait_for(job, lambda found: found.attempts == 2)
    monkeypatch.setattr("jointlab.jobs.queue.LEASE", timedelta(hours=1))  # the second one may be slow
    done = wait_for(job)
    assert (done.state, done.attempts) == (JobState.DONE, 2)


def test_a_job_that_is_cancelled_leaves_nothing(
    catalogue: Catalogue, queue: JobQueue, executor: ProcessExecutor, wait_for: Wait
) -> None:
    before = analyses(catalogue)
    job = queue.add("identify", QUICK, "test")
    wait_for(job, lambda found: found.stage is not None)
    assert queue.cancel(job.id).state is JobState.CANCELLED
    after = queue.add("export", {"run": 1, "form": "bundle"}, "test")  # there is room again
    assert wait_for(after).state is JobState.DONE
    assert wait_for(job).state is JobState.CANCELLED
    assert analyses(catalogue) == before


def test_a_job_that_cannot_be_done_says_why(queue: JobQueue, wait_for: Wait) -> None:
    failed = wait_for(queue.add("identify", {"run": 99}, "test"))
    assert (failed.state, failed.error, failed.attempts) == (JobState.FAILED, "there is no run 99", 1)


@pytest.mark.parametrize(("form", "begins"), [("bundle", b"PK"), ("hdf5", b"\x89HDF"), ("report", b"<!doctype html>")])
def test_an_export_is_a_file_beside_the_waveforms(
    catalogue: Catalogue, queue: JobQueue, wait_for: Wait, form: str, begins: bytes
) -> None:
    done = wait_for(queue.add("export", {"run": 1, "form": form}, "test"))
    assert done.result is not None, done.error
    content = (exports_folder(catalogue) / done.result["file"]).read_bytes()
    assert content.startswith(begins)
    assert len(content) == done.result["bytes"]


def test_a_run_without_a_diagnosis_has_no_corrected_simulation(queue: JobQueue, wait_for: Wait) -> None:
    failed = wait_for(queue.add("export", {"run": 1, "form": "model"}, "test"))
    assert failed.error == "run 1 has no diagnosis; make one with jointlab gap diagnose 1"


def test_a_kind_that_there_is_not_is_refused(queue: JobQueue) -> None:
    with pytest.raises(JointlabError, match="no kind of job 'dance'; there are master, diagnose"):
        queue.add("dance", {}, "test")


def test_a_job_that_takes_longer_than_its_kind_may_is_ended(
    queue: JobQueue, wait_for: Wait, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(KINDS, "identify", replace(KINDS["identify"], time_limit=0.0))
    job = wait_for(queue.add("identify", {"run": 1}, "test"))
    assert (job.state, job.error) == (JobState.FAILED, "it took longer than the 0 h of a job identify")
    after = queue.add("export", {"run": 1, "form": "bundle"}, "test")  # there is room again
    assert wait_for(after).state is JobState.DONE


@pytest.mark.parametrize("database_kind", ["sqlite", "postgresql"])
def test_a_caller_has_a_number_of_jobs_that_are_not_over(catalogue: Catalogue, idle: JobQueue) -> None:
    first, *_ = [idle.add("identify", {"run": 1}, "ann") for _ in range(3)]
    with pytest.raises(QuotaError, match="3 jobs of ann are not over"):
        idle.add("identify", {"run": 1}, "ann")
    idle.add("identify", {"run": 1}, "bob")
    idle.cancel(first.id)
    idle.add("identify", {"run": 1}, "ann")


def test_the_same_job_is_queued_once_where_that_is_wanted(idle: JobQueue) -> None:
    first = idle.add("diagnose", {"run": 1}, "ann", once=True)
    with pytest.raises(ConflictError, match=f"job {first.id} does that already"):
        idle.add("diagnose", {"run": 1}, "ann", once=True)
    idle.add("diagnose", {"run": 2}, "ann", once=True)
    idle.cancel(first.id)
    idle.add("diagnose", {"run": 1}, "ann", once=True)


@pytest.mark.parametrize("database_kind", ["postgresql"])  # SQLite has one writer at a time
def test_the_same_job_is_queued_once_where_two_ask_at_the_same_time(
    catalogue: Catalogue, idle: JobQueue, postgresql: Server
) -> None:
    def ask(name: str, check: Callable[[Session], None] | None = None) -> object:
        return idle.add("diagnose", {"run": 1}, name, once=True, check=check)

    with ThreadPoolExecutor(2) as asking:
        second = list[Future[object]]()

        def meanwhile(_: Session) -> None:
            second.append(asking.submit(ask, "bob"))
            until(lambda: second[0].done() or is_waiting(postgresql))

        first = asking.submit(ask, "ann", meanwhile)
        assert first.exception(LONG) is None
        with pytest.raises(ConflictError, match="job 1 does that already"):
            second[0].result(LONG)


def test_an_export_is_begun_beside_a_diagnosis_and_both_beside_a_trial(catalogue: Catalogue) -> None:
    """Each job holds the only place until it is dropped."""
    held = Holding()
    queue = JobQueue(catalogue, held)
    jobs = {}
    for kind, parameters in (
        ("trial", {"cases": 1, "seed": 1}), ("diagnose", {"run": 1}), ("export", {"run": 1, "form": "hdf5"}),
    ):  # fmt: skip
        jobs[kind] = queue.add(kind, parameters, "ann").id
        until(lambda: jobs[kind] in held.begun)  # noqa: B023 - called within the loop
    second = queue.add("diagnose", {"run": 2}, "ann").id
    export = queue.add("export", {"run": 1, "form": "report"}, "ann").id
    queue.cancel(jobs["export"])
    until(lambda: export in held.begun)
    assert second not in held.begun  # two diagnoses are not done at a time
    queue.close()


def test_an_export_does_not_wait_for_a_long_identification(catalogue: Catalogue) -> None:
    held = Holding()
    queue = JobQueue(catalogue, held)
    for kind, parameters in (("identify", {"run": 1}), ("export", {"run": 1, "form": "hdf5"})):
        until(partial(held.has_begun, queue.add(kind, parameters, "ann").id))
    queue.close()


@pytest.mark.parametrize("database_kind", ["sqlite", "postgresql"])
def test_what_a_person_waits_for_is_done_before_trials(catalogue: Catalogue, idle: JobQueue) -> None:
    asked = ("trial", "trial", "export", "identify", "diagnose", "identify")
    parameters: dict[str, dict[str, Any]] = {"trial": {"cases": 1, "seed": 1}, "export": {"run": 1, "form": "hdf5"}}
    for number, kind in enumerate(asked):
        idle.add(kind, parameters.get(kind, {"run": 1}), str(number))
    with catalogue.writing() as session:
        taken = [take_job(session, tuple(KINDS)) for _ in asked]
    done = [(each[0].kind, each[0].asked_by) for each in taken if each is not None]
    assert done == [
        ("diagnose", "4"), ("identify", "3"), ("identify", "5"), ("export", "2"), ("trial", "0"), ("trial", "1"),
    ]  # fmt: skip


def test_a_person_does_not_wait_for_a_trial_that_holds_the_only_place(queue: JobQueue, wait_for: Wait) -> None:
    trial = queue.add("trial", {"cases": 500, "seed": 1}, "ann")
    wait_for(trial, lambda found: found.state is JobState.RUNNING)
    second = queue.add("trial", {"cases": 500, "seed": 2}, "ann")
    assert wait_for(queue.add("export", {"run": 1, "form": "bundle"}, "bob")).state is JobState.DONE
    assert [queue.cancel(each.id).attempts for each in (trial, second)] == [1, 0]


def test_old_files_of_exports_are_removed_and_nothing_else(catalogue: Catalogue) -> None:
    folder = exports_folder(catalogue)
    folder.mkdir()
    cut_off = "run-1-5-1.h5.unfinished"
    exports = ("run-1-1-1.zip", "run-1-2-1.h5", "run-1-3-1.html", "run-1-4-1.h5")
    for name in (*exports, cut_off, "run-1-notes.txt", "other.zip"):
        path = folder / name
        path.write_bytes(b"x")
        if name != "run-1-4-1.h5":
            os.utime(path, (0, 0))
    assert remove_old_exports(catalogue, 30) == 4
    assert sorted(path.name for path in folder.iterdir()) == ["other.zip", "run-1-4-1.h5", "run-1-notes.txt"]


def test_a_queue_removes_old_files_by_itself(catalogue: Catalogue) -> None:
    folder = exports_folder(catalogue)
    folder.mkdir()
    old = folder / "run-1-1-1.zip"
    old.write_bytes(b"x")
    os.utime(old, (0, 0))
    queue = JobQueue(catalogue, ProcessExecutor(1))
    until(lambda: not old.exists())
    queue.close()


def test_a_queue_removes_old_idempotency_keys_by_itself(catalogue: Catalogue, monkeypatch: pytest.MonkeyPatch) -> None:
    old = partial(remove_old_requests, kept=timedelta(0), always_kept=0)
    monkeypatch.setattr("jointlab.jobs.queue.remove_old_requests", old)
    with catalogue.writing() as session:
        begin_request(session, "bench", "key", "fingerprint")
    queue = JobQueue(catalogue, ProcessExecutor(1))

    def kept() -> bool:
        with catalogue.reading() as session:
            return find_request(session, "bench", "key") is not None

    until(lambda: not kept())
    queue.close()


def test_jobs_of_a_queue_that_is_closed_are_done_by_the_next(
    catalogue: Catalogue, executor: ProcessExecutor, wait_for: Wait
) -> None:
    with catalogue.writing() as session:
        job = add_job(session, "identify", {"run": 1}, "test")
        for _ in range(MOST_ATTEMPTS - 1):  # so that another attempt that fails would be the last one
            taken = take_job(session, ("identify",))
            assert taken is not None
            lose_job(session, job.id, taken[1], "its process was killed")
    first = JobQueue(catalogue, executor)
    wait_for(job, lambda found: found.stage is not None)
    first.close()
    waiting = wait_for(job, lambda found: found.state is JobState.QUEUED)
    assert waiting.error == "the service was stopped"
    second = JobQueue(catalogue, ProcessExecutor(1))
    try:
        assert wait_for(job, lambda found: found.state is JobState.RUNNING).attempts == MOST_ATTEMPTS + 1
        second.cancel(job.id)
    finally:
        second.close()
