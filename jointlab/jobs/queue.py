"""The queue of jobs: gives queued jobs to an executor, and queues those again that their workers lost."""

import logging
import threading
import time
from typing import Any

from jointlab.jobs.executors import Executor, Lost
from jointlab.jobs.kinds import kind_named
from jointlab.jobs.stale_workers import StaleWorkers
from store.catalogue import Catalogue
from store.errors import StoreError
from store.jobs import Job, add_job, cancel_job, list_jobs, lose_job, signs_of_life, take_job
from store.states import JobState

POLL = 0.25  # s
STALE_CHECK = 5.0  # s between two checks for workers without a sign of life
log = logging.getLogger(__name__)


class JobQueue:
    """Serves jobs in a thread of its own until it is closed. Any thread may call it.

    Several queues may serve one database: each job is taken by one of them.
    """

    def __init__(self, catalogue: Catalogue, executor: Executor) -> None:
        self._catalogue = catalogue
        self._executor = executor
        self._dropped = set[int]()
        self._wake = threading.Event()
        self._closed = False
        self._checked = -STALE_CHECK
        self._stale_workers = StaleWorkers()
        self._thread = threading.Thread(target=self._run, name="jobs", daemon=True)
        self._thread.start()

    def add(self, kind: str, parameters: dict[str, Any], who: str) -> Job:
        """Queue a job. Raises JointlabError where there is no such kind, StoreError where it cannot be stored."""
        needs, takes = kind_named(kind).needs, kind_named(kind).takes
        given = set(parameters)
        assert set(needs) <= given <= {*needs, *takes}, f"a job {kind} needs {', '.join(needs)}, not {', '.join(given)}"
        with self._catalogue.writing() as session:
            job = add_job(session, kind, parameters, who)
        self._wake.set()
        return job

    def cancel(self, job_id: int) -> Job:
        """End a job, if it is not over. Raises NotFoundError where there is no such job."""
        with self._catalogue.writing() as session:
            job = cancel_job(session, job_id)
        self._dropped.add(job_id)
        self._wake.set()
        return job

    def close(self) -> None:
        """End every worker; jobs that are not over are queued again, for the next queue of this database."""
        self._closed = True
        self._wake.set()
        self._thread.join()
        self._lose(self._executor.close())

    def _run(self) -> None:
        while not self._closed:
            try:
                self._serve()
            except StoreError as error:
                log.warning("jobs wait, because the store does not answer: %s", error)
            except Exception:  # of a cluster that is gone, say; the thread has to go on
                log.exception("jobs wait, because of an unexpected error; the queue goes on")
            self._wake.wait(POLL)
            self._wake.clear()

    def _serve(self) -> None:
        while self._dropped:
            self._executor.drop(self._dropped.pop())
        self._lose(self._executor.lost())
        if time.monotonic() - self._checked > STALE_CHECK:
            self._checked = time.monotonic()
            with self._catalogue.reading() as session:
                stale = self._stale_workers.lasting(signs_of_life(session))
            self._lose([Lost(sign.job_id, sign.token, "its worker gave no sign of life") for sign in stale])
            for sign in stale:  # a worker that hangs would take the place of another
                self._executor.drop(sign.job_id)
        while not self._closed and self._executor.has_room() and self._is_waiting():
            with self._catalogue.writing() as session:
                taken = take_job(session)
            if taken is None:
                return
            job, token = taken
            try:
                self._executor.begin(self._catalogue.url, str(self._catalogue.waveforms.folder), job.id, token)
            except Exception as error:
                self._lose([Lost(job.id, token, f"no worker could begin it: {error}")])
                raise

    def _is_waiting(self) -> bool:
        """Whether a job is queued; a read, so that no writer has to wait."""
        with self._catalogue.reading() as session:
            return bool(list_jobs(session, state=JobState.QUEUED, limit=1))

    def _lose(self, lost: list[Lost]) -> None:
        for each in lost:
            with self._catalogue.writing() as session:
                lose_job(session, each.job_id, each.token, each.why)
