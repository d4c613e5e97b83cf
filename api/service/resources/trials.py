"""Trials of the gap diagnosis, on cases whose truth is sealed until it has answered."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Response
from pydantic import BaseModel, ConfigDict, Field

from api.service.access import Reader
from api.service.context import Context, Jobs
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import Act
from api.service.links import job_links
from api.service.pages import LARGEST, Cursor, Limit, Page
from api.service.problems import problems
from api.service.resources.jobs import JobDocument, page_of_jobs, queue_job, queueing
from store.states import JobState

router = APIRouter(prefix="/trials", tags=["trials"], route_class=TaggedRoute)


class NewTrial(BaseModel):
    """How many cases are drawn, and which."""

    model_config = ConfigDict(extra="forbid")

    cases: int = Field(ge=1, le=10_000)
    seed: int = Field(default=0, ge=0, le=LARGEST)


@router.get("", responses=problems(401, 403))
def list_(
    _who: Reader, context: Context, state: JobState | None = None, limit: Limit = 100, cursor: Cursor = None
) -> Page[JobDocument]:
    """List trials, newest first; the scores are in the result of each that is done."""
    return page_of_jobs(context, state, "trial", limit, cursor)


@router.post("", status_code=202, response_model=JobDocument, responses=problems(401, 403, 409) | job_links())
def create(act: Annotated[Act, queueing("trial")], jobs: Jobs, wanted: NewTrial) -> Response:
    """Queue a trial."""
    return queue_job(act, jobs, "trial", wanted.model_dump())
