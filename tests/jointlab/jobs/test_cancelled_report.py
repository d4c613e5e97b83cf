"""A report that is printed and cancelled: its browser ends, its files go, and nothing else is touched."""

import multiprocessing
from pathlib import Path

import pytest

from jointlab.jobs.executors import ProcessExecutor
from jointlab.jobs.queue import JobQueue
from store.catalogue import Catalogue
from store.states import JobState
from tests.jointlab.jobs.conftest import Wait
from tests.printers import is_alive, others_browser, put_endless_printer
from tests.waiting import until


class Spawning(ProcessExecutor):
    """Processes with the environment of the test."""

    def __init__(self) -> None:
        super().__init__(workers=1)
        # the product's server of processes, of another type, keeps the environment with which it was started
        self._context = multiprocessing.get_context("spawn")  # type: ignore[assignment]


def test_the_browser_of_a_cancelled_report_ends_and_no_other(
    catalogue: Catalogue, wait_for: Wait, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    started, environment = put_endless_printer(tmp_path)
    for name in ("PATH", "TMPDIR", "PYTHONPATH"):
        monkeypatch.setenv(name, environment[name])
    queue = JobQueue(catalogue, Spawning())
    try:
        with others_browser() as runs:
            job = queue.add("export", {"run": 1, "form": "report-pdf"}, "test")
            wait_for(job, lambda found: len(started()) == 2 or found.state is JobState.FAILED)
            assert all(map(is_alive, started()))
            assert queue.cancel(job.id).state is JobState.CANCELLED
            until(lambda: not any(map(is_alive, started())))
            until(lambda: not list(Path(environment["TMPDIR"]).glob("*/report.html")))
            assert runs()
    finally:
        queue.close()
