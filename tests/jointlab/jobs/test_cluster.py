"""Parts of a job on all workers of its cluster: spread, and done again where a worker or the scheduler dies."""

import os
import time
from collections.abc import Iterator
from concurrent.futures import wait
from pathlib import Path

import pytest

from jointlab.jobs.cluster import ClusterLostError, other_workers
from jointlab.jobs.executors import DaskExecutor
from jointlab.jobs.kinds import trial_folder
from jointlab.jobs.queue import JobQueue
from jointlab.trials.folder import TrialFolder
from jointlab.trials.plan import plan
from jointlab.trials.run import TrialSettings, seal_all
from store.catalogue import Catalogue
from store.states import JobState
from tests.jointlab.jobs.conftest import StartWorker, Wait, start_scheduler
from tests.waiting import until

distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")


@pytest.fixture
def catalogue(tmp_path: Path) -> Iterator[Catalogue]:
    """An empty one."""
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as opened:
        yield opened


def process_of(part: int, folder: Path) -> int:
    """The process that does a part, once it is told to end."""
    (folder / f"part-{part}-{os.getpid()}").touch()
    while not (folder / "released").exists():
        time.sleep(0.01)
    return os.getpid()


def in_parts(folder: Path) -> tuple[int, set[int]]:
    """A job that has one part for each worker: how many, and the processes that did them."""
    (folder / f"job-{os.getpid()}").touch()
    with other_workers() as others:
        assert others is not None
        pool, workers = others
        parts = [pool.submit(process_of, part, folder) for part in range(workers)]
        wait(parts)
        return workers, {part.result() for part in parts}


def processes(folder: Path, kind: str) -> list[int]:
    """Processes that have begun a job, or a part of one."""
    return [int(path.name.rpartition("-")[2]) for path in folder.glob(f"{kind}-*")]


def test_without_a_cluster_there_are_no_other_workers() -> None:
    with other_workers() as others:
        assert others is None


def test_parts_are_spread_over_all_workers_and_that_of_a_killed_one_is_done_by_another(
    scheduler: str, start_worker: StartWorker, tmp_path: Path
) -> None:
    started = {each.pid: each for each in (start_worker(scheduler), start_worker(scheduler))}
    with distributed.Client(scheduler, set_as_default=False) as client:
        until(lambda: len(client.nthreads()) == len(started))
        job = client.submit(in_parts, tmp_path, pure=False)
        until(lambda: set(processes(tmp_path, "part")) == set(started))
        (own,) = processes(tmp_path, "job")
        (other,) = set(started) - {own}
        started[other].kill()
        (tmp_path / "released").touch()
        assert job.result() == (2, {own})


def test_a_worker_keeps_no_profile_of_its_calls(scheduler: str, start_worker: StartWorker) -> None:
    start_worker(scheduler)
    with distributed.Client(scheduler, set_as_default=False) as client:
        until(lambda: bool(client.nthreads()))
        client.submit(time.sleep, 1.5, pure=False).result()  # dask's profiler stores what it saw every second
        assert client.profile()["count"] == 0


def test_a_job_whose_scheduler_dies_learns_it(start_worker: StartWorker, tmp_path: Path) -> None:
    process, address = start_scheduler()
    with process:
        start_worker(address)
        client = distributed.Client(address, set_as_default=False)
        job = client.submit(told_of_the_loss, tmp_path, pure=False)
        until(lambda: bool(processes(tmp_path, "part")))
        process.kill()
    (tmp_path / "released").touch()
    until(lambda: (tmp_path / "lost").exists())
    assert job.status != "finished"
    client.close(timeout=1)


def told_of_the_loss(folder: Path) -> None:
    """The job of which the scheduler dies."""
    try:
        in_parts(folder)
    except ClusterLostError:
        (folder / "lost").touch()


def test_a_trial_goes_on_where_it_ended_on_any_worker(
    catalogue: Catalogue, scheduler: str, start_worker: StartWorker, wait_for: Wait
) -> None:
    start_worker(scheduler)
    queue = JobQueue(catalogue, DaskExecutor("tcp://127.0.0.1:9"))  # no worker takes it yet
    job = queue.add("trial", {"cases": 1, "seed": 3}, "test")
    queue.close()
    trial = TrialSettings(cases=1, seed=3, folder=trial_folder(catalogue, job.id))
    folder, cases = TrialFolder(trial.folder), plan(1, 3)
    folder.begin(trial.settings)
    seal_all(folder, cases)
    for case in cases:
        folder.keep(case, {"error": f"answered by another worker: {case.name}", "seconds": 1.0})
    queue = JobQueue(catalogue, DaskExecutor(scheduler))
    try:
        done = wait_for(job)
    finally:
        queue.close()
    assert (done.state, done.error) == (JobState.DONE, None)
    assert done.result is not None
    assert [each.split(": ", 1)[1] for each in done.result["failed"]] == ["answered by another worker: 0001"]
    assert not trial.folder.exists()
