"""The queue of jobs: gives queued jobs to an executor, and queues those again that their workers lost."""

import logging
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from sqlalchemy.orm import Session

from jointlab.errors import ConflictError
from jointlab.jobs.executors import Executor, Lost
from jointlab.jobs.kinds import HOUR, KINDS, kind_named
from jointlab.jobs.limits import JobLimits, QuotaError, remove_old_exports
from store.catalogue import Catalogue
from store.errors import StoreError
from store.service.jobs import (
    LEASE,
    Job,
    JobLostError,
    SignOfLife,
    add_job,
    cancel_job,
    count_open_jobs,
    fail_job,
    find_open_job,
    list_jobs,
    lock_queue,
    lose_job,
    signs_of_life,
    take_job,
)
from store.service.requests import remove_old_requests
from store.states import JobState

POLL = 0.25  # s
STALE_CHECK = 5.0  # s between two checks for workers without a sign of life
LONGEST_GAP = 1.1 * STALE_CHECK  # s between two such looks that count as silence; they may be a little late
CLEANING = 3600.0  # s between two looks for old exports and requests
LIMITS = JobLimits()
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Begun:
    """A job that was begun here: its token, when it has to be over (monotonic, s), and its kind."""

    token: str
    ends: float
    kind: str


class JobQueue:
    """Serves jobs in a thread of its own until it is closed. Any thread may call it.

    Several queues may serve one database: each job is taken by one of them.
    """

    def __init__(self, catalogue: Catalogue, executor: Executor, limits: JobLimits = LIMITS) -> None:
        self._catalogue = catalogue
        self._executor = executor
        self._limits = limits
        self._begun = dict[int, _Begun]()
        self._cleaned = -CLEANING
        self._dropped = set[int]()
        self._wake = threading.Event()
        self._closed = False
        self._error: str | None = None
        self._checked = -STALE_CHECK
        self._stale_workers = StaleWorkers()
        self._thread = threading.Thread(target=self._run, name="jobs", daemon=True)
        self._thread.start()

    def add(
        self,
        kind: str,
        parameters: dict[str, Any],
        who: str,
        *,
        once: bool = False,
        check: Callable[[Session], None] | None = None,
    ) -> Job:
        """Queue a job; with `once`, not if the same one is not over yet.

        `check` is called before, in the same transaction; nothing is queued where it raises an error.

        Raises:
            ConflictError: the same one is not over, and only one is wanted.
            JointlabError: there is no such kind.
            QuotaError: too many jobs of this caller are not over.
            StoreError: it cannot be stored.
        """
        needs, takes = kind_named(kind).required_parameters, kind_named(kind).optional_parameters
        given = set(parameters)
        assert set(needs) <= given <= {*needs, *takes}, f"a job {kind} needs {', '.join(needs)}, not {', '.join(given)}"
        with self._catalogue.writing() as session:
            lock_queue(session)
            if (waiting := count_open_jobs(session, who)) >= self._limits.open_jobs:
                raise QuotaError(f"{waiting} jobs of {who} are not over; wait for one of them, or cancel one")
            if once and (same := find_open_job(session, kind, parameters)) is not None:
                raise ConflictError(f"job {same.id} does that already; wait for it, or cancel it")
            if check is not None:
                check(session)
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

    @property
    def trouble(self) -> str | None:
        """Why jobs wait though there would be work, or None; never waits."""
        return self._error or self._executor.trouble

    def _run(self) -> None:
        while not self._closed:
            error: str | None = None
            try:
                self._serve()
            except StoreError as failure:
                error = f"the store does not answer: {failure}"
                if error != self._error:
                    log.warning("jobs wait: %s", error)
            except Exception as failure:  # the thread has to go on
                error = f"unexpected error: {type(failure).__name__}: {failure}"
                if error != self._error:  # once, and not at every turn
                    log.exception("jobs wait, because of an unexpected error; the queue goes on")
            self._error = error
            self._wake.wait(POLL)
            self._wake.clear()

    def _serve(self) -> None:
        while self._dropped:
            self._executor.drop(self._dropped.pop())
        self._lose(self._executor.lost())
        self._end_overdue()
        if time.monotonic() - self._cleaned > CLEANING:
            self._cleaned = time.monotonic()
            remove_old_exports(self._catalogue, self._limits.export_days)
            with self._catalogue.writing() as session:
                if removed := remove_old_requests(session):
                    log.info("%s old idempotency keys are removed", removed)
        if time.monotonic() - self._checked > STALE_CHECK:
            self._checked = time.monotonic()
            with self._catalogue.reading() as session:
                signs = signs_of_life(session)
            running = {sign.job_id for sign in signs}
            self._begun = {job: begun for job, begun in self._begun.items() if job in running}
            stale = self._stale_workers.lasting(signs)
            self._lose([Lost(sign.job_id, sign.token, "its worker gave no sign of life") for sign in stale])
            for sign in stale:  # a worker that hangs would take the place of another
                self._executor.drop(sign.job_id)
        while not self._closed and (kinds := self._kinds_with_room()) and self._is_waiting():
            with self._catalogue.writing() as session:
                taken = take_job(session, kinds)
            if taken is None:
                return
            job, token = taken
            try:
                self._executor.begin(self._catalogue.place, job.id, token)
            except Exception as error:
                self._lose([Lost(job.id, token, f"no worker could begin it: {error}")])
                raise
            self._begun[job.id] = _Begun(token, time.monotonic() + kind_named(job.kind).time_limit, job.kind)

    def _kinds_with_room(self) -> tuple[str, ...]:
        """The kinds that may be begun now; beside every job that gives way to a kind, one more of that kind."""
        if self._executor.has_room():
            return tuple(KINDS)
        with self._catalogue.reading() as session:
            running = [job for job in list_jobs(session, state=JobState.RUNNING) if job.id in self._begun]
        patient = {name: sum(name in kind_named(job.kind).may_run_beside for job in running) for name in KINDS}
        return tuple(name for name, count in patient.items() if count and self._executor.has_room(count))

    def _end_overdue(self) -> None:
        """End the jobs that were begun here and take longer than their kind may."""
        now = time.monotonic()
        for job, begun in [each for each in self._begun.items() if now > each[1].ends]:
            hours = kind_named(begun.kind).time_limit / HOUR
            try:
                with self._catalogue.writing() as session:
                    fail_job(session, job, begun.token, f"it took longer than the {hours:g} h of a job {begun.kind}")
            except JobLostError:  # it is over, or another worker has it
                del self._begun[job]
                continue
            del self._begun[job]
            self._executor.drop(job)

    def _is_waiting(self) -> bool:
        """Whether a job is queued; a read, so that no writer has to wait."""
        with self._catalogue.reading() as session:
            return bool(list_jobs(session, state=JobState.QUEUED, limit=1))

    def _lose(self, lost: list[Lost]) -> None:
        for each in lost:
            with self._catalogue.writing() as session:
                lose_job(session, each.job_id, each.token, each.why, counts=each.counts)


class StaleWorkers:
    """Adds up for how long each sign of life was seen, and so knows the workers without a new one; for one thread.

    The time without a sign is measured here, by a monotonic clock. A time of the worker's own clock is only compared
    with the one before: that clock may be wrong, and be set between two heartbeats. Of the time between two looks
    `LONGEST_GAP` counts at most: where the store was away, no worker could give a sign either.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._looked = clock()
        self._silence = dict[SignOfLife, float]()  # s

    def lasting(self, signs: Iterable[SignOfLife]) -> list[SignOfLife]:
        """Those of `signs`, the latest ones, that have not been renewed for longer than a lease."""
        now = self._clock()
        gap, self._looked = min(now - self._looked, LONGEST_GAP), now
        self._silence = {sign: self._silence[sign] + gap if sign in self._silence else 0.0 for sign in signs}
        return [sign for sign, silence in self._silence.items() if silence > LEASE.total_seconds()]
