"""Jobs on a dask.distributed cluster of this computer: the same results, whichever worker dies."""

import re
import subprocess
import sys
from collections.abc import Callable, Iterator

import pytest

from jointlab.errors import JointlabError
from jointlab.jobs.executors import DaskExecutor
from jointlab.jobs.queue import JobQueue
from store.catalogue import Catalogue
from store.states import JobState
from tests.api.conftest import Command
from tests.jointlab.jobs.conftest import Wait

pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
START = "import asyncio, sys\nfrom distributed import Scheduler\n" + (
    "async def main():\n"
    "    async with Scheduler(host='127.0.0.1', port=0, dashboard=False) as scheduler:\n"
    "        print(scheduler.address, flush=True)\n"
    "        await scheduler.finished()\n"
    "asyncio.run(main())\n"
)


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """A scheduler in a process of its own; its address."""
    process = subprocess.Popen([sys.executable, "-c", START], stdout=subprocess.PIPE, text=True)
    with process:
        assert process.stdout is not None
        yield process.stdout.readline().strip()
        process.terminate()


@pytest.fixture
def start_worker(scheduler: str) -> Iterator[Callable[[], subprocess.Popen[str]]]:
    """Start `jointlab worker` in a process of its own."""
    started: list[subprocess.Popen[str]] = []

    def start() -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "api.cli", "worker", scheduler]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        started.append(process)
        assert process.stdout is not None
        assert re.match(r"works for tcp://127\.0\.0\.1:\d+", process.stdout.readline())
        return process

    yield start
    for process in started:
        with process:
            process.kill()


def test_a_job_whose_worker_is_killed_is_done_by_another_once(
    catalogue: Catalogue, scheduler: str, start_worker: Callable[[], subprocess.Popen[str]], wait_for: Wait
) -> None:
    first = start_worker()
    queue = JobQueue(catalogue, DaskExecutor(scheduler))
    try:
        job = queue.add("identify", {"run": 1}, "test")
        wait_for(job, lambda found: found.stage is not None)
        first.kill()
        start_worker()
        done = wait_for(job)
    finally:
        queue.close()
    assert (done.state, done.error) == (JobState.DONE, None)
    assert done.result is not None


def test_a_scheduler_that_does_not_answer_is_said() -> None:
    with pytest.raises(JointlabError, match=r"no dask scheduler answers at tcp://127\.0\.0\.1:9"):
        DaskExecutor("tcp://127.0.0.1:9", timeout=0.5)


def test_a_worker_needs_a_scheduler(jointlab: Command) -> None:
    answer = jointlab("worker")
    assert (answer.returncode, "say which scheduler" in answer.stderr) == (3, True)
