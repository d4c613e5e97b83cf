"""Identifications: jobs that find k, h and gamma of a run by both methods, and compare them."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Response
from pydantic import BaseModel, ConfigDict, Field

from analysis.modal.estimator import Estimator
from api.service.context import Context, Jobs, Services
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import Act
from api.service.links import job_links
from api.service.pages import LARGEST
from api.service.problems import problems
from api.service.resources.jobs import JobDocument, queue_job, queueing
from jointlab.identification.options import (
    LONGEST_WINDOW,
    LOOSEST,
    MOST_ELEMENTS,
    SHORTEST_CONSTANT,
    SHORTEST_FORCE,
    TIGHTEST,
)
from store.quantity import quantity
from store.runs import Run, get_run

router = APIRouter(prefix="/identifications", tags=["identifications"], route_class=TaggedRoute)


class OfRun(BaseModel):
    """Which run."""

    model_config = ConfigDict(extra="forbid")

    run: int = Field(ge=1, le=LARGEST, description="number of the run")


class NewIdentification(OfRun):
    """Which run, and what is chosen by hand."""

    free_beam: int | None = Field(
        default=None, ge=1, le=LARGEST, description="run on the suspended beam, whose damping, E and rho the beam has"
    )
    elements: int | None = Field(
        default=None,
        ge=1,
        le=MOST_ELEMENTS,
        description="of the beam between neighbouring nodes; 1 is the paper's mesh",
    )
    joint_exponent: Annotated[
        float, quantity("1", "standard deviation of the power of frequency that joints follow", ge=0, le=1)
    ] = 0.0
    regularise: Annotated[
        float | None,
        quantity(
            "1",
            "share of its size within which every term is held about the paper's method; by default none is",
            ge=TIGHTEST,
            le=LOOSEST,
        ),
    ] = None
    estimator: Estimator = Field(
        default=Estimator.H1,
        description="average of the blows: H1 trusts the force, H2 the acceleration, Hv both alike",
    )
    force_window: Annotated[
        float | None, quantity("s", "after the trigger, that force counts", ge=SHORTEST_FORCE, le=LONGEST_WINDOW)
    ] = None
    exponential_window: Annotated[
        float | None,
        quantity(
            "s",
            "time constant of a window on force and acceleration; its damping is taken out again",
            ge=SHORTEST_CONSTANT,
            le=LONGEST_WINDOW,
        ),
    ] = None


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
