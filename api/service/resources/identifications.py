"""Identifications: jobs that find k, h and gamma of a run by both methods, and compare them."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Response
from pydantic import BaseModel, ConfigDict, Field

from api.service.context import Context, Jobs, Services
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import Act
from api.service.links import job_links
from api.service.pages import LARGEST
from api.service.problems import problems
from api.service.resources.jobs import JobDocument, queue_job, queueing
from jointlab.identification.options import Options
from store.runs import Run, get_run

router = APIRouter(prefix="/identifications", tags=["identifications"], route_class=TaggedRoute)


class OfRun(BaseModel):
    """Which run."""

    model_config = ConfigDict(extra="forbid")

    run: int = Field(ge=1, le=LARGEST, description="number of the run")


class NewIdentification(Options, OfRun):
    """Which run, and the options."""


@router.post("", status_code=202, response_model=JobDocument, responses=problems(401, 403, 404, 409) | job_links())
def create(
    act: Annotated[Act, queueing("identify")], context: Context, jobs: Jobs, wanted: NewIdentification
) -> Response:
    """Queue an identification; its results are beside older ones when the job is done."""

    def check() -> None:
        for run in (wanted.run, wanted.free_beam):
            if run is not None:
                existing_run(context, run)

    return queue_job(act, jobs, "identify", wanted.model_dump(mode="json", exclude_defaults=True), check)


def existing_run(context: Services, run_id: int) -> Run:
    """A run.

    Raises:
        NotFoundError: there is no such run.
    """
    with context.catalogue.reading() as session:
        return get_run(session, run_id)
