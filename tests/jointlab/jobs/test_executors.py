"""Jobs on a dask.distributed cluster of this computer: the same results, whichever worker dies."""

import time
from pathlib import Path

import pytest

from jointlab.errors import JointlabError
from jointlab.jobs.executors import RETRY, DaskExecutor
from jointlab.jobs.queue import JobQueue
from store.catalogue import Catalogue
from store.states import JobState
from tests.api.conftest import Command
from tests.jointlab.jobs.conftest import StartWorker, Wait, start_scheduler
from tests.waiting import until

pytest.importorskip("distributed", reason="the extra `cluster` is not installed")


def test_a_job_whose_worker_is_killed_is_done_by_another_once(
    catalogue: Catalogue, scheduler: str, start_worker: StartWorker, wait_for: Wait
) -> None:
    first = start_worker(scheduler)
    queue = JobQueue(catalogue, DaskExecutor(scheduler))
    try:
        job = queue.add("identify", {"run": 1}, "test")
        wait_for(job, lambda found: found.stage is not None)
        first.kill()
        start_worker(scheduler)
        done = wait_for(job)
    finally:
        queue.close()
    assert (done.state, done.error) == (JobState.DONE, None)
    assert done.result is not None


def test_jobs_go_on_when_a_scheduler_that_died_is_back(
    catalogue: Catalogue, start_worker: StartWorker, wait_for: Wait, caplog: pytest.LogCaptureFixture
) -> None:
    process, address = start_scheduler()
    with process:
        worker = start_worker(address)
        queue = JobQueue(catalogue, DaskExecutor(address))
        until(lambda: queue.trouble is None)
        process.kill()
    try:
        until(lambda: queue.trouble is not None and "no dask scheduler answers" in queue.trouble)
        job = queue.add("export", {"run": 1, "form": "hdf5"}, "test")
        begun = time.monotonic()
        until(lambda: time.monotonic() - begun > 3 * RETRY)  # several attempts, of which only the first is told
        again, _ = start_scheduler(int(address.rpartition(":")[2]))
        with again:
            assert wait_for(job).state is JobState.DONE
            assert queue.trouble is None
            again.terminate()
    finally:
        queue.close()
    assert worker.poll() is None
    told = [record for record in caplog.records if record.name.startswith("jointlab")]
    assert len(told) <= 4
    assert not [record for record in told if record.exc_info]


def test_a_worker_of_another_database_is_told_apart(
    catalogue: Catalogue, scheduler: str, start_worker: StartWorker, wait_for: Wait, tmp_path: Path
) -> None:
    start_worker(scheduler, f"sqlite:///{tmp_path / 'other.db'}")
    queue = JobQueue(catalogue, DaskExecutor(scheduler))
    try:
        failed = wait_for(queue.add("export", {"run": 1, "form": "hdf5"}, "test"))
    finally:
        queue.close()
    assert failed.state is JobState.FAILED
    assert "other.db does not have job 1 as it was taken; set database_url" in (failed.error or "")


def test_a_queue_tells_that_no_scheduler_answers(catalogue: Catalogue) -> None:
    queue = JobQueue(catalogue, DaskExecutor("tcp://127.0.0.1:9"))
    until(lambda: queue.trouble is not None)
    assert queue.trouble is not None
    assert queue.trouble.startswith("no dask scheduler answers at tcp://127.0.0.1:9: ")
    queue.close()


@pytest.mark.parametrize("address", ["nonsense", "tcp://", "tcp://host:port"])
def test_what_is_no_address_is_refused(address: str) -> None:
    with pytest.raises(JointlabError, match=r"is no address of a dask scheduler; write tcp://host:8786"):
        DaskExecutor(address)


def test_a_worker_needs_a_scheduler(jointlab: Command) -> None:
    answer = jointlab("worker")
    assert (answer.returncode, "name the scheduler" in answer.stderr) == (3, True)
