"""Exports: a run as a bundle, as HDF5 or as a report, made by a job and fetched as a file."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Response
from fastapi.responses import FileResponse
from pydantic import Field

from api.service.access import Reader
from api.service.context import Context, Jobs
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import Act
from api.service.links import job_links
from api.service.pages import Cursor, Limit, Page
from api.service.problems import problems
from api.service.resources.identifications import OfRun, existing_run
from api.service.resources.jobs import JobDocument, JobNumber, job_document, page_of_jobs, queue_job, queueing
from jointlab.errors import ConflictError
from jointlab.jobs.kinds import exports_folder
from store.errors import NotFoundError
from store.states import JobState

router = APIRouter(prefix="/exports", tags=["exports"], route_class=TaggedRoute)


class NewExport(OfRun):
    """Which run, and in which form."""

    form: Literal["bundle", "hdf5", "report"] = Field(description="UFF and JSON in a .zip; waveforms; HTML")


@router.get("", responses=problems(401, 403))
def list_(
    _who: Reader, context: Context, state: JobState | None = None, limit: Limit = 100, cursor: Cursor = None
) -> Page[JobDocument]:
    """List exports, newest first; the number of an export is that of its job."""
    return page_of_jobs(context, state, "export", limit, cursor)


@router.post("", status_code=202, response_model=JobDocument, responses=problems(401, 403, 404, 409) | job_links())
def create(act: Annotated[Act, queueing("export")], context: Context, jobs: Jobs, wanted: NewExport) -> Response:
    """Queue an export; its file can be fetched when the job is done."""
    return queue_job(act, jobs, "export", wanted.model_dump(), lambda: existing_run(context, wanted.run))


@router.get(
    "/{job_id}/file",
    response_class=FileResponse,
    responses=problems(401, 403, 404, 409)
    | {200: {"description": "the file", "content": {"application/octet-stream": {}}}},
)
def file(_who: Reader, context: Context, job_id: JobNumber) -> FileResponse:
    """The file of an export that is done."""
    job = job_document(context, job_id)
    if job.kind != "export":
        raise NotFoundError(f"there is no export {job_id}")
    if job.result is None:
        raise ConflictError(f"export {job_id} is {job.state}: {job.error or 'its file is not made yet'}")
    path = exports_folder(context.catalogue) / job.result["file"]
    if not path.is_file():
        raise NotFoundError(f"the file of export {job_id} was removed from {path.parent}; ask for it again")
    return FileResponse(path, media_type="application/octet-stream", filename=path.name)
