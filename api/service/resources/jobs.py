"""Jobs: how far they are, what came of them, and cancelling them."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from datetime import datetime
from typing import Annotated, Any

import anyio
from anyio import to_thread
from fastapi import APIRouter, Depends, Query, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent
from pydantic import BaseModel, Field

from api.service.access import Reader
from api.service.context import Context, Jobs, Services
from api.service.documents import Words, number_of
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import Act, acting
from api.service.links import first_of
from api.service.pages import Cursor, Limit, Page, number_from, page_of
from api.service.problems import problems
from store.jobs import Job, get_job, list_jobs
from store.states import OVER, JobState, Scope

router = APIRouter(prefix="/jobs", tags=["jobs"], route_class=TaggedRoute)
JobNumber = Annotated[int, number_of("job")]
POLL = 0.5  # s between looks at a job that is followed


class JobDocument(BaseModel):
    """One job; times are UTC."""

    id: int
    kind: str
    state: JobState
    parameters: dict[str, Any]
    asked_by: str
    attempts: int = Field(description="how often it was begun; more than once where a worker was lost")
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    heartbeat_at: datetime | None = Field(description="when its worker last showed that it lives")
    stage: str | None
    done: int = Field(description="steps of the stage, of `total`")
    total: int
    result: dict[str, Any] | None
    error: str | None

    @classmethod
    def of(cls, job: Job) -> JobDocument:
        """What is shown of a job."""
        return cls(**{name: getattr(job, name) for name in cls.model_fields})


@router.get("", responses=problems(401, 403) | first_of("job_id", "jobs-get", "jobs-cancel"))
def list_(
    _who: Reader,
    context: Context,
    state: JobState | None = None,
    kind: Annotated[Words | None, Query(description="identify, diagnose, trial, export")] = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Page[JobDocument]:
    """List jobs, newest first."""
    return page_of_jobs(context, state, kind, limit, cursor)


@router.get("/{job_id}", responses=problems(401, 403, 404))
def get(_who: Reader, context: Context, job_id: JobNumber) -> JobDocument:
    """One job."""
    return job_document(context, job_id)


@router.post("/{job_id}/cancel", response_model=JobDocument, responses=problems(401, 403, 404, 409))
def cancel(
    act: Annotated[Act, acting("cancel job", "job {job_id}", Scope.ANALYSE)], jobs: Jobs, job_id: JobNumber
) -> Response:
    """End a job; one that is over stays as it is."""
    return act.once(lambda: JobDocument.of(jobs.cancel(job_id)))


def job_document(context: Services, job_id: int) -> JobDocument:
    """A job as it stands.

    Raises:
        NotFoundError: there is no such job.
    """
    with context.catalogue.reading() as session:
        return JobDocument.of(get_job(session, job_id))


def existing_job(context: Context, job_id: JobNumber) -> JobDocument:
    """A dependency: the job that a request is about, looked for before anything is answered."""
    return job_document(context, job_id)


@router.get("/{job_id}/events", response_class=EventSourceResponse, responses=problems(401, 403, 404))
async def events(
    _who: Reader, context: Context, found: Annotated[JobDocument, Depends(existing_job)]
) -> AsyncIterator[ServerSentEvent]:
    """How far the job is, whenever that changes, until it is over."""
    latest, shown = found, dict[str, Any]()
    while True:
        changing = latest.model_dump(exclude={"heartbeat_at"})
        if changing != shown:
            shown = changing
            yield ServerSentEvent(event=latest.state.value, data=latest)
        if latest.state in OVER:
            return
        await anyio.sleep(POLL)
        latest = await to_thread.run_sync(job_document, context, latest.id)


def page_of_jobs(
    context: Services, state: JobState | None, kind: str | None, limit: int, cursor: str | None
) -> Page[JobDocument]:
    """A page of jobs, newest first."""
    with context.catalogue.reading() as session:
        found = list_jobs(session, state=state, kind=kind, before=number_from(cursor), limit=limit + 1)
    return page_of([JobDocument.of(job) for job in found], limit, lambda job: job.id)


def queueing(kind: str) -> Any:
    """A dependency: the act of queueing a job of this kind."""
    return acting(f"queue {kind}", "jobs", Scope.ANALYSE)


def queue_job(
    act: Act, jobs: Jobs, kind: str, parameters: dict[str, Any], check: Callable[[], object] = lambda: None
) -> Response:
    """Queue a job, if `check` raises nothing, and answer with it."""

    def add() -> JobDocument:
        check()
        return JobDocument.of(jobs.add(kind, parameters, act.who.name))

    return act.once(add, 202, **parameters)
