"""Gap diagnoses: what explains the gap between a run and its simulation."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field

from api.service.access import Reader
from api.service.context import Context, Jobs
from api.service.documents import number_of
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import Act
from api.service.links import first_of, job_links
from api.service.pages import LARGEST, Cursor, Limit, Page, number_from, page_of
from api.service.problems import problems
from api.service.resources.identifications import OfRun, existing_run
from api.service.resources.jobs import JobDocument, queue_job, queueing
from store.diagnoses import StoredVerdict, get_diagnosis, list_diagnoses
from store.quantity import quantity

router = APIRouter(prefix="/diagnoses", tags=["gap diagnoses"], route_class=TaggedRoute)


class DiagnosisSummary(BaseModel):
    """What a diagnosis found, in short."""

    id: int
    status: str = Field(description="none, explained, partial or unknown")
    effects: list[str] = Field(description="that explain the gap")
    gap_before_percent: Annotated[float | None, quantity("%", "on data that no fit saw")]
    gap_after_percent: Annotated[float | None, quantity("%", "on data that no fit saw")]
    created_at: datetime | None

    @classmethod
    def of(cls, found: StoredVerdict) -> DiagnosisSummary:
        """What is shown of a diagnosis in a list."""
        same = set(DiagnosisSummary.model_fields) - {"id", "effects"}
        shown = {name: getattr(found, name) for name in same}
        return DiagnosisSummary(id=found.analysis_id, effects=list(found.effects), **shown)


class DiagnosisDocument(DiagnosisSummary):
    """A diagnosis with the whole of what it found."""

    document: dict[str, Any] = Field(description="in the format jointlab-diagnosis/1")


@router.get("", responses=problems(401, 403) | first_of("diagnosis_id", "gap-diagnoses-get"))
def list_(
    _who: Reader,
    context: Context,
    run: Annotated[int | None, Query(ge=1, le=LARGEST, description="only of this run")] = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Page[DiagnosisSummary]:
    """List diagnoses, newest first."""
    with context.catalogue.reading() as session:
        found = list_diagnoses(session, run_id=run, before=number_from(cursor), limit=limit + 1)
    return page_of([DiagnosisSummary.of(each) for each in found], limit, lambda each: each.id)


@router.post("", status_code=202, response_model=JobDocument, responses=problems(401, 403, 404, 409) | job_links())
def create(act: Annotated[Act, queueing("diagnose")], context: Context, jobs: Jobs, wanted: OfRun) -> Response:
    """Queue a diagnosis of a run; the job's result says its number."""
    return queue_job(act, jobs, "diagnose", wanted.model_dump(), lambda: existing_run(context, wanted.run))


@router.get("/{diagnosis_id}", responses=problems(401, 403, 404))
def get(_who: Reader, context: Context, diagnosis_id: Annotated[int, number_of("diagnosis")]) -> DiagnosisDocument:
    """One diagnosis."""
    with context.catalogue.reading() as session:
        found = get_diagnosis(session, diagnosis_id)
    return DiagnosisDocument(**DiagnosisSummary.of(found).model_dump(), document=found.document)
