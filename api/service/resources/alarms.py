"""Routes of alarms: list them, acknowledge one, and send a test alarm."""

from typing import Annotated

from fastapi import APIRouter, Query, Response
from sqlalchemy.orm import Session

from api.service.access import ReaderContext
from api.service.context import Services
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import IdempotentRequest, idempotent
from api.service.pages import Page, Paging
from api.service.parameters import document, first_of, links, number_of
from api.service.problems import problems
from jointlab.alarms.new import new_test
from jointlab.documents.alarms import Acknowledgement, AlarmDocument, DeliveryDocument
from jointlab.errors import ConflictError
from store.service.alarms import Alarm, acknowledge_alarm, add_alarm, get_alarm, list_alarms, list_deliveries
from store.states import Scope

router = APIRouter(prefix="/alarms", tags=["alarms"], route_class=TaggedRoute)
AlarmNumber = Annotated[int, number_of("alarm")]
Standing = Annotated[bool | None, Query(description="true: that nobody has acknowledged; false: the others")]


@router.get("", name="list_", responses=problems() | first_of("alarm_id", "alarms-get", "alarms-acknowledge"))
def list_all_alarms(context: ReaderContext, paging: Paging, standing: Standing = None) -> Page[AlarmDocument]:
    """List alarms of every rig, newest first."""
    with context.catalogue.reading() as session:
        found = list_alarms(session, standing=standing, before=paging.number, limit=paging.rows)
        return paging.of_rows(_documents(session, found))


@router.get("/{alarm_id}", responses=problems(404))
def get(context: ReaderContext, alarm_id: AlarmNumber) -> AlarmDocument:
    """One alarm."""
    with context.catalogue.reading() as session:
        return _documents(session, [get_alarm(session, alarm_id)])[0]


@router.post(
    "/test",
    status_code=201,
    response_model=AlarmDocument,
    responses=problems(409) | links(201, "alarm_id", "alarms-get", "alarms-acknowledge"),
)
def test(request: Annotated[IdempotentRequest, idempotent("test alarms", "alarms", Scope.ADMIN)]) -> Response:
    """Raise a test alarm: it goes to everybody who gets alarms."""

    def add() -> AlarmDocument:
        deliverer = request.services.alarms
        if deliverer is None:
            raise ConflictError("this service tells no alarms; ask the one that was started with jointlab serve")
        with request.services.catalogue.writing() as session:
            made = add_alarm(session, new_test(deliverer.rig, request.caller.name))
            assert made is not None, "each test has a cause of its own"
            found = _documents(session, [made])[0]
        deliverer.look()
        return found

    return request.once(add, 201)


@router.post("/{alarm_id}/acknowledge", response_model=AlarmDocument, responses=problems(404, 409))
def acknowledge(
    request: Annotated[IdempotentRequest, idempotent("acknowledge alarm", "alarm {alarm_id}", Scope.CONTROL)],
    alarm_id: AlarmNumber,
    given: Acknowledgement,
) -> Response:
    """Say that somebody has seen an alarm: nobody else is told of it. The first acknowledgement stays."""

    def note() -> AlarmDocument:
        with request.services.catalogue.writing() as session:
            alarm = acknowledge_alarm(session, alarm_id, request.caller.name, given.note or "")
            found = _documents(session, [alarm])[0]
        look(request.services)
        return found

    return request.once(note, **given.model_dump())


def look(services: Services) -> None:
    """Let the service see what has changed."""
    if services.alarms is not None:
        services.alarms.look()


def _documents(session: Session, alarms: list[Alarm]) -> list[AlarmDocument]:
    deliveries = list_deliveries(session, [alarm.id for alarm in alarms])
    return [
        document(
            AlarmDocument, alarm, deliveries=[document(DeliveryDocument, each) for each in deliveries.get(alarm.id, ())]
        )
        for alarm in alarms
    ]  # fmt: skip
