"""Jobs: the state of longer work is in the database.

A worker takes a job with a token and a lease, and renews the lease with every heartbeat. If the worker dies, the
heartbeats stop for longer than a lease, the job is queued again, and the token of the dead worker is no longer valid:
there is exactly one result. The service measures the silence by its own clock (`jointlab.jobs.queue`), because
the times stored here are those of the worker's computer, whose clock may be wrong.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any
from uuid import uuid4

from sqlalchemy import case, func, select, update
from sqlalchemy.orm import Session

from store.database.connection import AdvisoryLock, lock_until_end
from store.errors import StoreError
from store.models.rows import add_row, equal, from_row, get_row, newest_first
from store.models.service import JobRow
from store.states import ENDED_JOB_STATES, OPEN_JOB_STATES, JobState
from store.text import changed, without_halves

LEASE = timedelta(seconds=15)
MOST_ATTEMPTS = 3


class JobLostError(StoreError):
    """The job was cancelled or given to another worker; the result of this worker does not count."""


@dataclass(frozen=True)
class Job:
    """One job; times are UTC.

    Attributes:
        kind: identify, diagnose, investigate, master, trial, export.
        asked_by: the person or program that asked for it.
        attempts: how often a worker began it.
        stage, done, total: the worker's progress.
        now: what the worker does and has found so far, in words; None where none works on it or says so.
        result: None until the job is done; of one that has failed, what is known of the cause beside `error`, if
            anything.
        error: why it failed, or why its last attempt was lost.
    """

    id: int
    kind: str
    state: JobState
    parameters: dict[str, Any]
    asked_by: str
    attempts: int
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    heartbeat_at: datetime | None
    stage: str | None
    done: int
    total: int
    now: str | None
    result: dict[str, Any] | None
    error: str | None


@dataclass(frozen=True)
class SignOfLife:
    """The last heartbeat of the worker with this token, by the worker's own clock."""

    job_id: int
    token: str
    at: datetime | None


def lock_queue(session: Session) -> None:
    """Let nobody else who calls this add a job until this transaction ends, so that what was counted holds."""
    lock_until_end(session.connection(), AdvisoryLock.JOB_QUEUE)


def add_job(session: Session, kind: str, parameters: dict[str, Any], asked_by: str) -> Job:
    """Queue a job; StoreError if the parameters have no JSON form."""
    row = JobRow(
        kind=kind, state=JobState.QUEUED, parameters=parameters, asked_by=asked_by, attempts=0, cancelled=False,
        done=0, total=0,
    )  # fmt: skip
    return _job(add_row(session, row))


def get_job(session: Session, job_id: int) -> Job:
    """One job, or NotFoundError."""
    return _job(get_row(session, JobRow, job_id, "job"))


def list_jobs(
    session: Session,
    *,
    state: JobState | None = None,
    kind: str | None = None,
    before: int | None = None,
    limit: int = 100,
) -> list[Job]:
    """Jobs, newest first; a page begins before the number `before`."""
    query = select(JobRow).where(*equal(JobRow, state=state, kind=kind))
    return [_job(row) for row in session.scalars(newest_first(query, JobRow.id, before, limit))]


@dataclass(frozen=True)
class JobSeries:
    """A series of jobs: each continues where the one before it ended.

    Attributes:
        first: the first job; its number is also the number of the series.
        newest: the last job, which has the latest state; equal to `first` if there is only one job.
    """

    first: Job
    newest: Job


def list_series(
    session: Session,
    kind: str,
    name: str,
    *,
    run_id: int | None = None,
    number: int | None = None,
    before: int | None = None,
    limit: int = 100,
) -> list[JobSeries]:
    """Series of jobs of one kind, the series begun last first.

    Args:
        kind: of all jobs of a series.
        name: the parameter by which a further job names the first one; a first job does not have it.
        run_id: only those whose first job has this ``run``.
        number: only the series with this number.
        before: a page begins before this number.
        limit: the most that are listed.
    """
    query = select(JobRow).where(JobRow.kind == kind, JobRow.parameters[name].as_integer().is_(None))
    if run_id is not None:
        query = query.where(JobRow.parameters["run"].as_integer() == run_id)
    if number is not None:
        query = query.where(JobRow.id == number)
    firsts = [_job(row) for row in session.scalars(newest_first(query, JobRow.id, before, limit))]
    first = JobRow.parameters[name].as_integer()
    among = first.in_([each.id for each in firsts])
    latest = select(func.max(JobRow.id)).where(JobRow.kind == kind, among).group_by(first)
    rows = session.scalars(select(JobRow).where(JobRow.id.in_(latest)))
    newest = {row.parameters[name]: _job(row) for row in rows}
    return [JobSeries(each, newest.get(each.id, each)) for each in firsts]


def lock_job(session: Session, job_id: int) -> None:
    """Let no other transaction change this job, or lock it, until this one ends; nothing where there is no such job."""
    session.get(JobRow, job_id, with_for_update=True)


def find_open_job(session: Session, kind: str, parameters: dict[str, Any]) -> Job | None:
    """The oldest job of this kind with these parameters that is not over."""
    rows = session.scalars(
        select(JobRow).where(JobRow.state.in_(OPEN_JOB_STATES)).order_by(JobRow.id)
    )  # few, whatever the kind
    return next((_job(row) for row in rows if (row.kind, row.parameters) == (kind, parameters)), None)


def count_open_jobs(session: Session, asked_by: str) -> int:
    """The number of jobs that somebody has asked for and that are not over."""
    query = select(func.count()).where(JobRow.asked_by == asked_by, JobRow.state.in_(OPEN_JOB_STATES))
    return session.scalar(query) or 0


@dataclass(frozen=True)
class JobCounts:
    """Jobs that are not over, and for how many seconds the oldest queued one waits (0 without one)."""

    queued: int
    running: int
    longest_wait: float


def count_jobs(session: Session) -> JobCounts:
    """How many jobs wait and are worked on."""
    query = select(JobRow.state, func.count(), func.min(JobRow.created_at)).where(JobRow.state.in_(OPEN_JOB_STATES))
    found = {state: (count, oldest) for state, count, oldest in session.execute(query.group_by(JobRow.state))}
    queued, oldest = found.get(JobState.QUEUED, (0, None))
    wait = 0.0 if oldest is None else max(0.0, (datetime.now(UTC) - oldest).total_seconds())
    return JobCounts(queued, found.get(JobState.RUNNING, (0, None))[0], wait)


def take_job(session: Session, kinds: Sequence[str]) -> tuple[Job, str] | None:
    """The next queued job, now running, and the token for its worker; None if no job of these kinds waits.

    Args:
        kinds: of the jobs that may be taken, the most urgent first. Of one kind, the oldest job is next.
    """
    urgency = case({kind: place for place, kind in enumerate(kinds)}, value=JobRow.kind)
    waiting = select(JobRow.id).where(JobRow.state == JobState.QUEUED, JobRow.kind.in_(kinds))
    number = session.scalars(waiting.order_by(urgency, JobRow.id).limit(1)).one_or_none()
    if number is None:
        return None
    now, token = datetime.now(UTC), uuid4().hex
    taken = session.execute(
        update(JobRow)
        .where(JobRow.id == number, JobRow.state == JobState.QUEUED)
        .values(
            state=JobState.RUNNING, attempts=JobRow.attempts + 1, lease_token=token, leased_until=now + LEASE,
            heartbeat_at=now, started_at=now, stage=None, done=0, total=0, now=None,
        )
    )  # fmt: skip
    if taken.rowcount == 0:  # type: ignore[attr-defined]  # an UPDATE has one
        return None  # another worker was faster
    return get_job(session, number), token


def renew_lease(
    session: Session, job_id: int, token: str, stage: str | None, done: int, total: int, now: str = ""
) -> None:
    """Store a heartbeat and the worker's progress; JobLostError if the job is no longer the worker's."""
    row = _held(session, job_id, token)
    row.heartbeat_at = datetime.now(UTC)
    row.leased_until = row.heartbeat_at + LEASE
    row.stage, row.done, row.total, row.now = stage, done, total, now or None


def finish_job(session: Session, job_id: int, token: str, result: dict[str, Any]) -> None:
    """Store the result, in the transaction that stores the other results of the job.

    Raises:
        JobLostError: the job is no longer the worker's; nothing of the transaction is stored then.
        StoreError: the result has no JSON form.
    """
    row = _held(session, job_id, token)
    row.result = result
    _end(row, JobState.DONE)


def fail_job(session: Session, job_id: int, token: str, error: str, cause: dict[str, Any] | None = None) -> None:
    """End a job that another attempt would not help either; JobLostError if it is no longer the worker's.

    `cause` is kept as the result, for programs that tell the cause in other words.
    """
    row = _held(session, job_id, token)
    row.error, row.result = error, cause
    _end(row, JobState.FAILED)


def lose_job(session: Session, job_id: int, token: str, why: str, *, counts: bool = True) -> None:
    """Queue a job again whose worker is gone; it fails after `MOST_ATTEMPTS`, where the loss `counts` against it."""
    row = session.get(JobRow, job_id, with_for_update=True)  # its worker may be done in this moment
    if row is None or row.state != JobState.RUNNING or row.lease_token != token:
        return
    if counts and row.attempts >= MOST_ATTEMPTS:
        row.error = f"given up after {row.attempts} attempts; at the last one {why}"
        _end(row, JobState.FAILED)
    else:
        row.state, row.error, row.lease_token, row.leased_until, row.now = JobState.QUEUED, why, None, None, None


def signs_of_life(session: Session) -> list[SignOfLife]:
    """The latest one of every running job."""
    running = session.scalars(select(JobRow).filter_by(state=JobState.RUNNING).order_by(JobRow.id))
    return [SignOfLife(row.id, row.lease_token or "", row.heartbeat_at) for row in running]


def cancel_job(session: Session, job_id: int) -> Job:
    """End a job that is not over; its worker learns it with the next heartbeat, and its result does not count.

    Raises NotFoundError if there is no such job.
    """
    row = get_row(session, JobRow, job_id, "job", for_update=True)  # its worker may be done in this moment
    if row.state not in ENDED_JOB_STATES:
        row.cancelled = True
        _end(row, JobState.CANCELLED)
        session.flush()
    return _job(row)


def _end(row: JobRow, state: JobState) -> None:
    row.state, row.finished_at = state, datetime.now(UTC)
    row.lease_token = row.leased_until = row.now = None
    if state is JobState.DONE:
        row.error = None


def _held(session: Session, job_id: int, token: str) -> JobRow:
    row = session.get(JobRow, job_id, with_for_update=True)
    if row is None or row.state != JobState.RUNNING or row.lease_token != token:
        raise JobLostError(f"job {job_id} was cancelled or given to another worker; this result does not count")
    return row


def _job(row: JobRow) -> Job:
    return from_row(
        Job,
        row,
        state=JobState(row.state),
        parameters=changed(row.parameters, without_halves),
        result=changed(row.result, without_halves),
    )
