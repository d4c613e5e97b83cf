"""The demo's run in a catalogue of its own, or an empty one on PostgreSQL; queues in front of it; a dask cluster."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from store.catalogue import Catalogue
from store.service.jobs import Job, get_job, signs_of_life
from store.states import ENDED_JOB_STATES
from tests.waiting import LONG

Wait = Callable[..., Job]
QUICK = {"run": 1, "elements": 2, "joint_law": "constant"}
"""An identification of the demo's run that takes less than half as long as the usual one."""
ROOT = Path(__file__).resolve().parents[3]
START = "import asyncio, sys\nfrom distributed import Scheduler\n" + (
    "async def main():\n"
    "    async with Scheduler(host='127.0.0.1', port=int(sys.argv[1]), dashboard_address=':0') as scheduler:\n"
    "        print(scheduler.address, flush=True)\n"
    "        await scheduler.finished()\n"
    "asyncio.run(main())\n"
)
Process = subprocess.Popen[str]
StartWorker = Callable[..., Process]


@pytest.fixture
def database_kind() -> str:
    """SQLite with the demo's run, unless a test asks for both."""
    return "sqlite"


@pytest.fixture
def catalogue(database_kind: str, request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Catalogue]:
    """The demo's run; nothing on PostgreSQL."""
    if database_kind == "sqlite":
        assert request.getfixturevalue("measured") == 1
        place: tuple[str, Path | None] = f"sqlite:///{tmp_path / 'jointlab.db'}", None
    else:
        place = request.getfixturevalue("database_url"), tmp_path / "waveforms"
    with Catalogue.open(*place) as opened:
        yield opened


@pytest.fixture
def wait_for(catalogue: Catalogue) -> Wait:
    """Wait until a job is over, or until a condition holds, for as long as the job changes or its worker lives."""

    def wait(job: Job, is_so: Callable[[Job], bool] = lambda job: job.state in ENDED_JOB_STATES) -> Job:
        latest, ends = None, 0.0
        while True:
            with catalogue.reading() as session:
                found, signs = get_job(session, job.id), signs_of_life(session)
            if is_so(found):
                return found
            if latest != (found, signs):
                latest, ends = (found, signs), time.monotonic() + LONG
            assert time.monotonic() < ends, found
            time.sleep(0.05)

    return wait


def start_scheduler(port: int = 0) -> tuple[Process, str]:
    """A scheduler in a process of its own, and its address."""
    process = subprocess.Popen([sys.executable, "-c", START, str(port)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    return process, process.stdout.readline().strip()


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """The address of a scheduler."""
    process, address = start_scheduler()
    with process:
        yield address
        process.terminate()


@pytest.fixture
def start_worker(catalogue: Catalogue) -> Iterator[StartWorker]:
    """Start `jointlab worker` in a process of its own, with the catalogue in its configuration."""
    started: list[Process] = []

    def start(scheduler: str, database: str = catalogue.address) -> Process:
        command = [sys.executable, "-m", "api.cli", "worker", scheduler]
        environment = {**os.environ, "JOINTLAB_DATABASE_URL": database, "PYTHONPATH": str(ROOT)}
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
        started.append(process)
        assert process.stdout is not None
        assert re.match(r"works for tcp://127\.0\.0\.1:\d+", process.stdout.readline())
        return process

    yield start
    for process in started:
        with process:
            process.kill()
