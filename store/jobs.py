"""Jobs: the truth about work that takes its time is in SQL, whoever does it.

A job is taken with a token and a lease, which its worker renews with every heartbeat. Where the worker dies, heartbeats
stay away for longer than a lease, the job is queued again, and the token of the dead worker opens nothing: there is
exactly one result. Whoever waits for heartbeats measures that by a clock of their own (`jointlab.jobs.stale_workers`):
the times here are those of the worker's computer, which may be set, or go wrong.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any
from uuid import uuid4

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from store.errors import NotFoundError, StoreError
from store.models.service import JobRow
from store.states import OVER, JobState

LEASE = timedelta(seconds=15)
MOST_ATTEMPTS = 3


class LeaseLostError(StoreError):
    """The job was cancelled, or given to somebody else: whatever its worker has found does not count."""


@dataclass(frozen=True)
class Job:
    """One job; times are UTC.

    Attributes:
        kind: what is done: identify, diagnose, trial, export.
        parameters: with what.
        asked_by: who asked for it.
        attempts: how often it was begun.
        stage, done, total: what its worker is at, and how far.
        result: what came of it, None before.
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
    leased_until: datetime | None
    stage: str | None
    done: int
    total: int
    result: dict[str, Any] | None
    error: str | None


@dataclass(frozen=True)
class SignOfLife:
    """A heartbeat of the worker who holds `token`, at a time of the worker's own clock."""

    job_id: int
    token: str
    at: datetime | None


def add_job(session: Session, kind: str, parameters: dict[str, Any], asked_by: str) -> Job:
    """Queue a job.

    Raises:
        StoreError: the parameters have no JSON form.
    """
    row = JobRow(
        kind=kind, state=JobState.QUEUED, parameters=parameters, asked_by=asked_by, attempts=0, cancelled=False,
        done=0, total=0,
    )  # fmt: skip
    session.add(row)
    session.flush()
    return _job(row)


def get_job(session: Session, job_id: int) -> Job:
    """One job.

    Raises:
        NotFoundError: there is no such job.
    """
    return _job(_row(session, job_id))


def list_jobs(
    session: Session,
    *,
    state: JobState | None = None,
    kind: str | None = None,
    before: int | None = None,
    limit: int = 100,
) -> list[Job]:
    """Jobs, newest first; `before` a number, to go on with a list."""
    query = select(JobRow).order_by(JobRow.id.desc()).limit(limit)
    if state is not None:
        query = query.filter_by(state=state)
    if kind is not None:
        query = query.filter_by(kind=kind)
    if before is not None:
        query = query.where(JobRow.id < before)
    return [_job(row) for row in session.scalars(query)]


def take_job(session: Session) -> tuple[Job, str] | None:
    """Take the oldest queued job; with the token that its worker shows from then on. None where nothing waits."""
    number = session.scalars(
        select(JobRow.id).filter_by(state=JobState.QUEUED).order_by(JobRow.id).limit(1)
    ).one_or_none()
    if number is None:
        return None
    now, token = datetime.now(UTC), uuid4().hex
    taken = session.execute(
        update(JobRow)
        .where(JobRow.id == number, JobRow.state == JobState.QUEUED)
        .values(
            state=JobState.RUNNING, attempts=JobRow.attempts + 1, lease_token=token, leased_until=now + LEASE,
            heartbeat_at=now, started_at=now, stage=None, done=0, total=0,
        )
    )  # fmt: skip
    if taken.rowcount == 0:  # type: ignore[attr-defined]  # an UPDATE has one
        return None  # somebody else was faster
    return _job(_row(session, number)), token


def renew_lease(session: Session, job_id: int, token: str, stage: str | None, done: int, total: int) -> None:
    """Show that the worker lives, and how far it is.

    Raises:
        LeaseLostError: the job is no longer the worker's.
    """
    row = _held(session, job_id, token)
    now = datetime.now(UTC)
    row.heartbeat_at, row.leased_until = now, now + LEASE
    row.stage, row.done, row.total = stage, done, total


def finish_job(session: Session, job_id: int, token: str, result: dict[str, Any]) -> None:
    """Keep the result; in the transaction that stores everything else that came of the job.

    Raises:
        LeaseLostError: the job is no longer the worker's; nothing of the transaction is stored then.
        StoreError: the result has no JSON form.
    """
    row = _held(session, job_id, token)
    row.result = result
    _end(row, JobState.DONE)


def fail_job(session: Session, job_id: int, token: str, error: str) -> None:
    """Say that the work cannot be done, and why; trying it again would not help.

    Raises:
        LeaseLostError: the job is no longer the worker's.
    """
    row = _held(session, job_id, token)
    row.error = error
    _end(row, JobState.FAILED)


def lose_job(session: Session, job_id: int, token: str, why: str) -> None:
    """Queue a job again whose worker is known to be gone; it fails after `MOST_ATTEMPTS`."""
    row = session.get(JobRow, job_id)
    if row is not None and row.state == JobState.RUNNING and row.lease_token == token:
        _lose(row, why)


def signs_of_life(session: Session) -> list[SignOfLife]:
    """The latest one of every job that is being worked on."""
    running = session.scalars(select(JobRow).filter_by(state=JobState.RUNNING).order_by(JobRow.id))
    return [SignOfLife(row.id, row.lease_token or "", row.heartbeat_at) for row in running]


def cancel_job(session: Session, job_id: int) -> Job:
    """End a job that is not over; its worker finds out with the next heartbeat, and its result counts no more.

    Raises:
        NotFoundError: there is no such job.
    """
    row = _row(session, job_id)
    if row.state not in OVER:
        row.cancelled = True
        _end(row, JobState.CANCELLED)
        session.flush()
    return _job(row)


def _lose(row: JobRow, why: str) -> None:
    row.error = why
    row.lease_token = row.leased_until = None
    if row.attempts >= MOST_ATTEMPTS:
        row.error = f"given up after {row.attempts} attempts; at the last one {why}"
        _end(row, JobState.FAILED)
    else:
        row.state = JobState.QUEUED


def _end(row: JobRow, state: JobState) -> None:
    row.state, row.finished_at = state, datetime.now(UTC)
    row.lease_token = row.leased_until = None
    if state is JobState.DONE:
        row.error = None


def _held(session: Session, job_id: int, token: str) -> JobRow:
    row = session.get(JobRow, job_id, with_for_update=True)
    if row is None or row.state != JobState.RUNNING or row.lease_token != token:
        raise LeaseLostError(f"job {job_id} was cancelled or given to another worker; this result does not count")
    return row


def _row(session: Session, job_id: int) -> JobRow:
    row = session.get(JobRow, job_id)
    if row is None:
        raise NotFoundError(f"there is no job {job_id}")
    return row


def _job(row: JobRow) -> Job:
    return Job(
        id=row.id,
        kind=row.kind,
        state=JobState(row.state),
        parameters=row.parameters,
        asked_by=row.asked_by,
        attempts=row.attempts,
        created_at=row.created_at,
        started_at=row.started_at,
        finished_at=row.finished_at,
        heartbeat_at=row.heartbeat_at,
        leased_until=row.leased_until,
        stage=row.stage,
        done=row.done,
        total=row.total,
        result=row.result,
        error=row.error,
    )
