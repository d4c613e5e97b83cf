"""Routes of the rig: its state, control lease, limits and events as they happen, and STOP."""

from collections.abc import AsyncIterator
from dataclasses import asdict
from typing import Annotated

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, Header, Request, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent

from api.service.access import Controller, Reader, stranger
from api.service.context import Context, Rig, Services
from api.service.etags import IfMatch, TaggedRoute, check_unchanged, tag_of
from api.service.idempotent_requests import IdempotentRequest, LeaseToken, driving, idempotent
from api.service.parameters import document
from api.service.problems import problems
from api.service.rig_events import described_events
from jointlab.burst_log import AuditEvent
from jointlab.documents.rig import (
    LeaseDocument,
    LeaseRequest,
    Limits,
    PromptDocument,
    RigDocument,
    StopDocument,
    Stopped,
    StopResetRequest,
)
from jointlab.drive.journal import Journal
from jointlab.supervision.manager import RunManager
from rig.errors import RigError
from rig.registers import interlock_names
from rig.tester.limits import TesterLimits
from store.states import Scope

router = APIRouter(prefix="/rig", tags=["rig"], route_class=TaggedRoute)


@router.get("", responses=problems(409))
def get(_caller: Reader, rig: Rig) -> RigDocument:
    """The state of the rig."""
    prompt = rig.prompt
    return RigDocument(
        **(asdict(rig.state) | {"interlocks": interlock_names(rig.state.interlocks)}),
        tripped=rig.state.is_tripped,
        pause=rig.pause_number,
        stop_epoch=rig.stop_epoch,
        prompt=None if prompt is None else document(PromptDocument, prompt),
        stop=None if rig.stopped_by is None else document(StopDocument, rig.stopped_by),
        driven_by=rig.lease.holder,
        latest_event=rig.journal.latest,
    )


@router.post("/stop", responses=problems(409, 502, needs_key=False))
async def stop(request: Request, context: Context, rig: Rig) -> Stopped:
    """STOP: end the present run; answers with a driven actuator at rest. It needs no key, and stands until reset.

    A machine that its own software drives moves on: the answer is 502 then, and says to press its own stop.

    The drive process listens for STOP by itself, too, and is reached there where this service is not.
    """
    own_thread = CapacityLimiter(1)  # a stop does not wait for readers
    try:
        with request.app.state.metrics.stop_seconds.time():
            run_id = await to_thread.run_sync(rig.stop, _presser(request), limiter=own_thread)
    except RigError as error:
        _note_stop(request, context, None, f"failed: {error}")
        raise
    _note_stop(request, context, run_id, "done")
    return Stopped(run_id=run_id)


@router.post("/reset-stop", status_code=204, response_class=Response, responses=problems(409, 502))
def reset_stop(
    request: Annotated[IdempotentRequest, driving("reset stop", "rig")], rig: Rig, given: StopResetRequest
) -> Response:
    """Release a STOP, for the holder of the control lease; nothing moves by this."""
    return request.once(lambda: rig.reset_stop(given.epoch, request.lease), 204, **given.model_dump())


@router.post("/lease", status_code=201, response_model=LeaseDocument, responses=problems(409))
def take_lease(
    request: Annotated[IdempotentRequest, idempotent("take lease", "rig", Scope.CONTROL)], rig: Rig, given: LeaseRequest
) -> Response:
    """Take the control lease: the client that has it drives, and no other. It ends by itself unless it is renewed."""

    def take() -> LeaseDocument:
        others = Scope.ENGINEER in request.caller.scopes
        lease = rig.lease.take(given.holder, request.caller.name, by_force=given.by_force, from_others=others)
        return document(LeaseDocument, lease)

    return request.once(take, 201, **given.model_dump())


@router.put("/lease", responses=problems(409))
def renew_lease(_caller: Controller, rig: Rig, token: LeaseToken = None) -> LeaseDocument:
    """Go on driving. It needs no `Idempotency-Key`: sent twice, it has the same effect."""
    return document(LeaseDocument, rig.lease.renew(token))


@router.delete("/lease", status_code=204, response_class=Response, responses=problems(409))
def give_lease_back(
    request: Annotated[IdempotentRequest, idempotent("give lease back", "rig", Scope.CONTROL)],
    rig: Rig,
    token: LeaseToken = None,
) -> Response:
    """Stop driving."""
    return request.once(lambda: rig.lease.release(token), 204)


@router.get("/limits", responses=problems(409))
def limits(_caller: Reader, rig: Rig) -> Limits:
    """The rig's limits in force."""
    return _limits(rig)


@router.put("/limits", response_model=Limits, responses=problems(409, 412))
def set_limits(
    request: Annotated[IdempotentRequest, idempotent("set limits", "rig", Scope.ENGINEER)],
    rig: Rig,
    given: Limits,
    if_match: IfMatch = None,
) -> Response:
    """Set the rig's limits for runs that begin from now on, also after a restart of the service."""

    def check(in_force: TesterLimits) -> None:
        check_unchanged(if_match, tag_of(document(Limits, in_force).model_dump_json().encode()))

    def change() -> Limits:
        rig.set_limits(TesterLimits(**given.model_dump()), request.caller.name, check)
        return _limits(rig)

    return request.once(change, **given.model_dump())


@router.get("/events", response_class=EventSourceResponse, responses=problems(409) | {200: described_events()})
async def events(
    _caller: Reader,
    rig: Rig,
    last_event_id: Annotated[str | None, Header(alias="Last-Event-ID", description="of the last event seen")] = None,
) -> AsyncIterator[ServerSentEvent]:
    """What happens at the rig, as it happens; a reader who was cut off goes on after the last event seen."""
    async for entry in rig.journal.follow(_after(rig.journal, last_event_id)):
        data = {"at": entry.at.isoformat(), **entry.data}
        yield ServerSentEvent(event=entry.name, id=f"{rig.journal.epoch}-{entry.number}", data=data)


def _limits(rig: RunManager) -> Limits:
    return document(Limits, rig.instruments.limits)


def _after(journal: Journal, last_event_id: str | None) -> int:
    """The number of the event seen last, or where it is not known, of the latest event."""
    epoch, _, number = (last_event_id or "").partition("-")
    if last_event_id is None or not (number.isascii() and number.isdecimal()) or len(number) > 12:
        return journal.latest
    return int(number) if epoch == journal.epoch else 0


def _presser(request: Request) -> str:
    """Who has pressed STOP, as people are told: nobody is asked for a key, so that the address is all that is known."""
    return "the page or a program" + ("" if request.client is None else f" at {request.client.host}")


def _note_stop(request: Request, context: Services, run_id: int | None, outcome: str) -> None:
    """Note a stop; its caller does not wait for the database."""
    target = "rig" if run_id is None else f"run {run_id}"
    context.bursts.note(context.catalogue, AuditEvent(stranger(request), "stop", target, outcome))
