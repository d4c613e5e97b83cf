"""Routes of jobs: queueing identifications, trials and exports; progress, results and cancelling of all."""

from collections.abc import AsyncIterator, Callable
from typing import Annotated, Any

import anyio
from anyio import to_thread
from fastapi import APIRouter, Depends, Query, Response
from fastapi.responses import FileResponse
from fastapi.sse import EventSourceResponse, ServerSentEvent

from api.service.access import Reader, ReaderContext
from api.service.context import Context, Jobs, Services
from api.service.downloads import Download
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import IdempotentRequest, idempotent
from api.service.pages import Page, PageRequest, Paging
from api.service.parameters import document, first_of, links, number_of
from api.service.problems import problems
from jointlab.documents.jobs import JobDocument, NewExport, NewIdentification, NewTrial
from jointlab.jobs.kinds import JobKindName, UnfitPointsJobError, export_file, has_unfit_points
from store.catalogue import Catalogue
from store.measurements.runs import get_run
from store.service.jobs import Job, get_job, list_jobs
from store.states import ENDED_JOB_STATES, JobState, Scope

jobs = APIRouter(prefix="/jobs", tags=["jobs"], route_class=TaggedRoute)
identifications = APIRouter(prefix="/identifications", tags=["identifications"], route_class=TaggedRoute)
trials = APIRouter(prefix="/trials", tags=["trials"], route_class=TaggedRoute)
exports = APIRouter(prefix="/exports", tags=["exports"], route_class=TaggedRoute)
JobNumber = Annotated[int, number_of("job")]
POLL = 0.5
"""Seconds between two readings of a job that a client follows."""
LEAVE_OUT = "with leave_out_unfit_points in the request such points are left out, and the bundle says which"


def existing_job(context: Context, job_id: JobNumber) -> JobDocument:
    """A dependency: the job that a request is about, read before anything is answered."""
    with context.catalogue.reading() as session:
        return _document(get_job(session, job_id))


ExistingJob = Annotated[JobDocument, Depends(existing_job)]


def queues(*statuses: int) -> dict[str, Any]:
    """Arguments of a route that queues a job; `statuses` are of problems that it may answer beside the usual ones."""
    next_requests = links(202, "job_id", "jobs-get", "jobs-cancel", "exports-file")
    return {
        "status_code": 202, "response_model": JobDocument, "name": "create",
        "responses": problems(409, 429, *statuses) | next_requests,
    }  # fmt: skip


def queueing(kind: str) -> Any:
    """A dependency: the request to queue a job of this kind."""
    return idempotent(f"queue {kind}", "jobs", Scope.ANALYSE)


def queue_job(
    request: IdempotentRequest,
    queue: Jobs,
    kind: str,
    parameters: dict[str, Any],
    runs: tuple[int | None, ...] = (),
    check: Callable[[Catalogue], object] | None = None,
) -> Response:
    """Queue a job on existing runs, if the same one is not under way, and answer with it; None is passed over.

    `check` is called before; nothing is queued where it raises an error.
    """

    def add() -> JobDocument:
        if check is not None:
            check(request.services.catalogue)
        with request.services.catalogue.reading() as session:
            for run in runs:
                if run is not None:
                    get_run(session, run)
        return _document(queue.add(kind, parameters, request.caller.name, once=True))

    return request.once(add, 202, **parameters)


@identifications.post("", **queues(404))
def identify(
    request: Annotated[IdempotentRequest, queueing("identify")], queue: Jobs, given: NewIdentification
) -> Response:
    """Queue an identification; its results are beside older ones when the job is done."""
    parameters = given.model_dump(mode="json", exclude_defaults=True)
    return queue_job(request, queue, "identify", parameters, (given.run, given.free_beam))


@trials.get("", name="list_", responses=problems())
def list_trials(context: ReaderContext, paging: Paging, state: JobState | None = None) -> Page[JobDocument]:
    """List trials, newest first; the scores are in the result of each that is done."""
    return _page_of_jobs(context, paging, state, "trial")


@trials.post("", **queues())
def try_diagnosis(request: Annotated[IdempotentRequest, queueing("trial")], queue: Jobs, given: NewTrial) -> Response:
    """Queue a trial."""
    return queue_job(request, queue, "trial", given.model_dump())


@exports.get("", name="list_", responses=problems())
def list_exports(context: ReaderContext, paging: Paging, state: JobState | None = None) -> Page[JobDocument]:
    """List exports, newest first; the number of an export is that of its job."""
    return _page_of_jobs(context, paging, state, "export")


@exports.post("", **queues(404))
def export(request: Annotated[IdempotentRequest, queueing("export")], queue: Jobs, given: NewExport) -> Response:
    """Queue an export; its file can be fetched when the job is done."""
    return queue_job(request, queue, "export", given.model_dump(exclude_defaults=True), (given.run,))


@exports.get(
    "/{job_id}/file",
    response_class=FileResponse,
    responses=problems(404, 409, 429) | {200: {"description": "the file", "content": {"application/octet-stream": {}}}},
)
def file(who: Reader, context: Context, job_id: JobNumber) -> Download:
    """The file of an export that is done."""
    try:
        path = export_file(context.catalogue, job_id)
    except UnfitPointsJobError as error:
        error.add_note(LEAVE_OUT)
        raise
    return Download(path, context.downloads, who.name, media_type="application/octet-stream")


@jobs.get("", name="list_", responses=problems() | first_of("job_id", "jobs-get", "jobs-cancel"))
def list_all_jobs(
    context: ReaderContext,
    paging: Paging,
    state: JobState | None = None,
    kind: Annotated[JobKindName | None, Query(description="only of this one")] = None,
) -> Page[JobDocument]:
    """List jobs, newest first."""
    return _page_of_jobs(context, paging, state, kind)


@jobs.get("/{job_id}", responses=problems(404))
def get(_caller: Reader, found: ExistingJob) -> JobDocument:
    """One job."""
    return found


@jobs.post("/{job_id}/cancel", response_model=JobDocument, responses=problems(404, 409))
def cancel(
    request: Annotated[IdempotentRequest, idempotent("cancel job", "job {job_id}", Scope.ANALYSE)],
    queue: Jobs,
    job_id: JobNumber,
) -> Response:
    """End a job; one that is over stays as it is."""
    return request.once(lambda: _document(queue.cancel(job_id)))


@jobs.get("/{job_id}/events", response_class=EventSourceResponse, responses=problems(404))
async def events(context: ReaderContext, found: ExistingJob) -> AsyncIterator[ServerSentEvent]:
    """The progress of the job, whenever it changes, until the job is over."""
    latest, shown = found, dict[str, Any]()
    while True:
        changing = latest.model_dump(exclude={"heartbeat_at"})
        if changing != shown:
            shown = changing
            yield ServerSentEvent(event=latest.state.value, data=latest)
        if latest.state in ENDED_JOB_STATES:
            return
        await anyio.sleep(POLL)
        latest = await to_thread.run_sync(existing_job, context, latest.id)


def _page_of_jobs(
    context: Services, paging: PageRequest, state: JobState | None, kind: str | None
) -> Page[JobDocument]:
    found = context.catalogue.read(list_jobs, state=state, kind=kind, before=paging.number, limit=paging.rows)
    return paging.of_rows(list(map(_document, found)))


def _document(job: Job) -> JobDocument:
    """A job; where a bundle was refused for its sine points, its error says what to ask for."""
    return document(JobDocument, job, error=f"{job.error}; {LEAVE_OUT}" if has_unfit_points(job) else job.error)
