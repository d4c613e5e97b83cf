"""Routes of master curves: a specimen's stiffness over frequency and temperature, from sweeps at several of them."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from api.service.access import ReaderContext
from api.service.context import Jobs
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import IdempotentRequest
from api.service.pages import Page, Paging
from api.service.parameters import OptionalArticle, document, first_of, number_of
from api.service.problems import problems
from api.service.resources.jobs import queue_job, queueing, queues
from jointlab.documents.fields import OneLine
from jointlab.documents.master import MasterQuestion, MasterSummary, StoredMasterDocument
from jointlab.identification.master import specimen_sweeps
from store.results.master_curves import get_master_curve, list_master_curves

router = APIRouter(prefix="/master-curves", tags=["master curves"], route_class=TaggedRoute)


@router.get("", name="list_", responses=problems() | first_of("curve_id", "master-curves-get"))
def list_all_master_curves(
    context: ReaderContext,
    paging: Paging,
    article: OptionalArticle = None,
    specimen: Annotated[OneLine | None, Query(description="only of this joint's cylinders")] = None,
) -> Page[MasterSummary]:
    """List master curves, newest first."""
    found = context.catalogue.read(
        list_master_curves, article=article, specimen=specimen, before=paging.number, limit=paging.rows
    )
    return paging.of_rows([document(MasterSummary, each, id=each.analysis_id) for each in found])


@router.post("", **queues(404))
def compute(request: Annotated[IdempotentRequest, queueing("master")], queue: Jobs, given: MasterQuestion) -> Response:
    """Queue a master curve of a specimen; `master_curve` of the job's result is its number.

    422 says what to do where there are too few temperatures for the law of the shift, or no such points.
    """
    parameters = given.model_dump(mode="json", exclude_defaults=True)
    return queue_job(request, queue, "master", parameters, check=lambda catalogue: specimen_sweeps(catalogue, given))


@router.get("/{curve_id}", name="get", responses=problems(404))
def one_master_curve(
    context: ReaderContext, curve_id: Annotated[int, number_of("master curve")]
) -> StoredMasterDocument:
    """One master curve."""
    found = context.catalogue.read(get_master_curve, curve_id)
    return document(StoredMasterDocument, found, id=found.analysis_id)
