"""Jobs in processes: done once, taken up again when a worker is killed, cancelled when that is asked for."""

import os
import signal
from collections.abc import Iterator
from datetime import timedelta

import pytest
from sqlalchemy import text

from jointlab.errors import JointlabError
from jointlab.jobs.executors import ProcessExecutor
from jointlab.jobs.kinds import exports_folder
from jointlab.jobs.queue import JobQueue
from store.catalogue import Catalogue
from store.states import JobState
from tests.jointlab.jobs.conftest import Wait


@pytest.fixture
def executor() -> ProcessExecutor:
    return ProcessExecutor(workers=1)


@pytest.fixture
def queue(catalogue: Catalogue, executor: ProcessExecutor) -> Iterator[JobQueue]:
    made = JobQueue(catalogue, executor)
    yield made
    made.close()


def analyses(catalogue: Catalogue) -> int:
    with catalogue.reading() as session:
        return int(session.scalar(text("SELECT count(*) FROM analyses")) or 0)


def test_the_job_of_a_killed_worker_is_taken_up_again_and_has_one_result(
    catalogue: Catalogue, queue: JobQueue, executor: ProcessExecutor, wait_for: Wait
) -> None:
    before = analyses(catalogue)
    job = queue.add("identify", {"run": 1}, "test")
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

    def begin(self, url: str, waveform_folder: str, job_id: int, token: str) -> None:
        if not self.faltered:
            self.faltered = True
            raise OSError("no more processes")
        super().begin(url, waveform_folder, job_id, token)


def test_a_worker_that_cannot_be_begun_costs_an_attempt_and_not_the_queue(catalogue: Catalogue, wait_for: Wait) -> None:
    queue = JobQueue(catalogue, Faltering(workers=1))
    try:
        done = wait_for(queue.add("export", {"run": 1, "form": "hdf5"}, "test"))
    finally:
        queue.close()
    assert (done.state, done.attempts) == (JobState.DONE, 2)


def test_a_worker_that_hangs_makes_room_for_another(
    catalogue: Catalogue, queue: JobQueue, executor: ProcessExecutor, wait_for: Wait, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("jointlab.jobs.queue.STALE_CHECK", 0.2)
    job = queue.add("identify", {"run": 1}, "test")
    wait_for(job, lambda found: found.stage is not None)
    pid = executor._processes[job.id][0].pid
    assert pid is not None
    os.kill(pid, signal.SIGSTOP)
    monkeypatch.setattr("jointlab.jobs.stale_workers.LEASE", timedelta(seconds=5))
    wait_for(job, lambda found: found.attempts == 2)
    monkeypatch.setattr("jointlab.jobs.stale_workers.LEASE", timedelta(hours=1))  # the second one may be slow
    done = wait_for(job)
    assert (done.state, done.attempts) == (JobState.DONE, 2)


def test_a_job_that_is_cancelled_leaves_nothing(
    catalogue: Catalogue, queue: JobQueue, executor: ProcessExecutor, wait_for: Wait
) -> None:
    before = analyses(catalogue)
    job = queue.add("identify", {"run": 1}, "test")
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


def test_a_kind_that_there_is_not_is_refused(queue: JobQueue) -> None:
    with pytest.raises(JointlabError, match="no kind of job 'dance'; there are identify"):
        queue.add("dance", {}, "test")


def test_jobs_of_a_queue_that_is_closed_are_done_by_the_next(
    catalogue: Catalogue, executor: ProcessExecutor, wait_for: Wait
) -> None:
    first = JobQueue(catalogue, executor)
    job = first.add("identify", {"run": 1}, "test")
    wait_for(job, lambda found: found.stage is not None)
    first.close()
    waiting = wait_for(job, lambda found: found.state is JobState.QUEUED)
    assert waiting.error == "the service was stopped"
    second = JobQueue(catalogue, ProcessExecutor(1))
    try:
        assert wait_for(job, lambda found: found.state is JobState.RUNNING).attempts == 2
        second.cancel(job.id)
    finally:
        second.close()
