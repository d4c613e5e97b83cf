"""Routes of examinations of the rig: their records, and a new one."""

from dataclasses import asdict
from typing import Annotated

from fastapi import APIRouter, Query, Response

from api.service.access import ReaderContext
from api.service.context import Rig
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import IdempotentRequest, driving
from api.service.pages import Page, Paging
from api.service.parameters import first_of, links, number_of
from api.service.problems import problems
from jointlab.commissioning.examination import asked_of
from jointlab.documents.commissioning import ExaminationDocument, ExaminationRequest
from jointlab.documents.fields import OneLine
from store.service.commissioning import CommissioningRecord, get_commissioning_record, list_commissioning_records

router = APIRouter(prefix="/examinations", tags=["examinations"], route_class=TaggedRoute)
ExaminationNumber = Annotated[int, number_of("examination")]


@router.get("", name="list_", responses=problems() | first_of("examination_id", "examinations-get"))
def list_examinations(
    context: ReaderContext, paging: Paging, rig: Annotated[OneLine | None, Query(description="name of the rig")] = None
) -> Page[ExaminationDocument]:
    """List examinations of every rig, newest first."""
    found = context.catalogue.read(list_commissioning_records, rig=rig, before=paging.number, limit=paging.rows)
    return paging.of_rows([_document(each) for each in found])


@router.get("/{examination_id}", responses=problems(404))
def get(context: ReaderContext, examination_id: ExaminationNumber) -> ExaminationDocument:
    """One examination."""
    with context.catalogue.reading() as session:
        return _document(get_commissioning_record(session, examination_id))


@router.post(
    "",
    status_code=201,
    response_model=ExaminationDocument,
    responses=problems(409, 502) | links(201, "examination_id", "examinations-get"),
)
def examine(
    request: Annotated[IdempotentRequest, driving("examine rig", "rig")], rig: Rig, given: ExaminationRequest
) -> Response:
    """Examine the rig, for the holder of the control lease, who signs what was found; answers within a minute."""

    def do() -> ExaminationDocument:
        return _document(rig.examine(asked_of(given, rig.commissioning), request.caller.name, request.lease))

    return request.once(do, 201, **given.model_dump(mode="json"))


def _document(record: CommissioningRecord) -> ExaminationDocument:
    return ExaminationDocument.model_validate(asdict(record))
