"""The rig: what it is at, who drives it, its limits, its events as they happen, and STOP."""

from __future__ import annotations

import threading
from collections.abc import AsyncIterator
from dataclasses import asdict
from typing import Annotated

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, BackgroundTasks, Header, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent
from pydantic import BaseModel, ConfigDict, Field, model_validator

from api.service.access import Controller, Reader
from api.service.context import Context, Rig, Services
from api.service.documents import Words
from api.service.etags import IfMatch, TaggedRoute, check_unchanged, tag_of
from api.service.idempotent_requests import Act, LeaseToken, acting
from api.service.problems import problems
from api.service.rig_events import described_events
from jointlab.supervision.journal import Entry, Journal
from jointlab.supervision.lease import Lease
from jointlab.supervision.manager import RunManager
from jointlab.supervision.phase import Phase
from rig.errors import RigError
from rig.tester_limits import TesterLimits
from store.audit import add_audit_entry
from store.quantity import quantity
from store.states import Scope

router = APIRouter(prefix="/rig", tags=["rig"], route_class=TaggedRoute)


class PromptDocument(BaseModel):
    """What the operator is asked to do."""

    number: int
    kind: str
    text: str
    waits: bool = Field(description="whether the run waits for the answer")


class RigDocument(BaseModel):
    """What the rig is at."""

    phase: Phase
    run_id: int | None = Field(description="the run that is carried out, or was last")
    title: str
    activity: str
    point: str | None = Field(description="that is struck, such as 3y; null while none is")
    blows: int
    blows_wanted: int
    sines: int
    sines_wanted: int
    ended_as: str | None
    reason: str | None
    interlocks: list[str] = Field(description="of the tester, that stopped it and were not acknowledged")
    tester_silent: str | None = Field(
        description="why the tester does not answer while nothing is carried out; null where it does"
    )
    prompt: PromptDocument | None
    driven_by: str | None = Field(description="who has the control lease")
    latest_event: int = Field(description="number of the latest event")

    @classmethod
    def of(cls, rig: RunManager) -> RigDocument:
        """What is shown of the rig."""
        prompt = rig.prompt
        return cls(
            **asdict(rig.state),
            prompt=None if prompt is None else PromptDocument(**asdict(prompt)),
            driven_by=rig.lease.holder,
            latest_event=rig.journal.latest,
        )


class LeaseRequest(BaseModel):
    """Who wants to drive."""

    model_config = ConfigDict(extra="forbid")

    holder: Words = Field(description="to be shown to others")
    by_force: bool = Field(
        default=False,
        description="take it over: from another client of the same key, or with the scope engineer from anybody",
    )


class LeaseDocument(BaseModel):
    """The right to drive: `token` goes into the header `Control-Lease` of every request that drives."""

    token: str
    holder: str
    seconds: Annotated[float, quantity("s", "until it ends unless it is renewed")]

    @classmethod
    def of(cls, lease: Lease) -> LeaseDocument:
        """What is shown of a lease."""
        return cls(**asdict(lease))


class Limits(BaseModel):
    """What the rig may ask of the tester, and see it do; the tester has limits of its own beside these."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    amplitude_pp: Annotated[float, quantity("m", "largest peak-to-peak amplitude"), Field(gt=0)]
    lowest_frequency: Annotated[float, quantity("Hz"), Field(gt=0)]
    highest_frequency: Annotated[float, quantity("Hz"), Field(gt=0)]
    lowest_preset: Annotated[float, quantity("m")]
    highest_preset: Annotated[float, quantity("m")]
    velocity: Annotated[float, quantity("m/s", "highest peak velocity of a cycle"), Field(gt=0)]
    acceleration: Annotated[float, quantity("m/s^2", "highest peak acceleration of a cycle"), Field(gt=0)]
    force: Annotated[float, quantity("N", "largest absolute force"), Field(gt=0)]

    @model_validator(mode="after")
    def _leave_something(self) -> Limits:
        if self.lowest_frequency >= self.highest_frequency or self.lowest_preset > self.highest_preset:
            raise ValueError("the lowest frequency and preset have to be below the highest")
        return self

    @classmethod
    def of(cls, rig: RunManager) -> Limits:
        """The limits in force."""
        return cls(**asdict(rig.instruments.limits))


class Stopped(BaseModel):
    """What was stopped: the number of a run, null where none was carried out; the actuator is at rest."""

    run_id: int | None


@router.get("", responses=problems(401, 403, 409))
def get(_who: Reader, rig: Rig) -> RigDocument:
    """What the rig is at."""
    return RigDocument.of(rig)


@router.post("/stop", responses=problems(409, 502))
async def stop(context: Context, rig: Rig, afterwards: BackgroundTasks) -> Stopped:
    """STOP: end whatever is carried out; answers with the actuator at rest. Open to everybody, without any key."""
    own_thread = CapacityLimiter(1)  # a stop waits for nobody who reads
    try:
        run_id = await to_thread.run_sync(rig.stop, limiter=own_thread)
    except RigError as error:  # whoever stops does not wait for the database, least of all now
        threading.Thread(target=_note_stop, args=(context, None, f"failed: {error}"), daemon=True).start()
        raise
    afterwards.add_task(_note_stop, context, run_id)
    return Stopped(run_id=run_id)


@router.post("/lease", status_code=201, response_model=LeaseDocument, responses=problems(401, 403, 409))
def take_lease(
    act: Annotated[Act, acting("take lease", "rig", Scope.CONTROL)], rig: Rig, wanted: LeaseRequest
) -> Response:
    """Take the control lease: the client that has it drives, and no other. It ends by itself unless it is renewed."""

    def take() -> LeaseDocument:
        others = Scope.ENGINEER in act.who.scopes
        lease = rig.lease.take(wanted.holder, act.who.name, by_force=wanted.by_force, from_others=others)
        return LeaseDocument.of(lease)

    return act.once(take, 201, **wanted.model_dump())


@router.put("/lease", responses=problems(401, 403, 409))
def renew_lease(_who: Controller, rig: Rig, token: LeaseToken = None) -> LeaseDocument:
    """Go on driving. It needs no `Idempotency-Key`: whoever sends it twice goes on driving all the same."""
    return LeaseDocument.of(rig.lease.renew(token))


@router.delete("/lease", status_code=204, response_class=Response, responses=problems(401, 403, 409))
def give_lease_back(
    act: Annotated[Act, acting("give lease back", "rig", Scope.CONTROL)], rig: Rig, token: LeaseToken = None
) -> Response:
    """Drive no more."""
    return act.once(lambda: rig.lease.give_back(token), 204)


@router.get("/limits", responses=problems(401, 403, 409))
def limits(_who: Reader, rig: Rig) -> Limits:
    """The rig's limits in force."""
    return Limits.of(rig)


@router.put("/limits", response_model=Limits, responses=problems(401, 403, 409, 412))
def set_limits(
    act: Annotated[Act, acting("set limits", "rig", Scope.ENGINEER)],
    rig: Rig,
    wanted: Limits,
    if_match: IfMatch = None,
) -> Response:
    """Set the rig's limits for runs that begin from now on, also when the service is started anew."""

    def change() -> Limits:
        check_unchanged(if_match, tag_of(Limits.of(rig).model_dump_json().encode()))
        rig.set_limits(TesterLimits(**wanted.model_dump()), act.who.name)
        return Limits.of(rig)

    return act.once(change, **wanted.model_dump())


@router.get(
    "/events", response_class=EventSourceResponse, responses=problems(401, 403, 409) | {200: described_events()}
)
async def events(
    _who: Reader,
    rig: Rig,
    last_event_id: Annotated[str | None, Header(alias="Last-Event-ID", description="of the last event seen")] = None,
) -> AsyncIterator[ServerSentEvent]:
    """What happens at the rig, as it happens; a reader who was cut off goes on after the last event seen."""
    async for entry in rig.journal.follow(_after(rig.journal, last_event_id)):
        yield _sent(rig.journal, entry)


def _after(journal: Journal, last_event_id: str | None) -> int:
    """Where to begin: behind the event seen last, or with what comes from now on."""
    epoch, _, number = (last_event_id or "").partition("-")
    if last_event_id is None or not (number.isascii() and number.isdecimal()) or len(number) > 12:
        return journal.latest
    return int(number) if epoch == journal.epoch else 0


def _sent(journal: Journal, entry: Entry) -> ServerSentEvent:
    return ServerSentEvent(
        event=entry.name, id=f"{journal.epoch}-{entry.number}", data={"at": entry.at.isoformat(), **entry.data}
    )  # fmt: skip


def _note_stop(context: Services, run_id: int | None, outcome: str = "done") -> None:
    with context.catalogue.writing() as session:
        target = "rig" if run_id is None else f"run {run_id}"
        add_audit_entry(session, who="whoever pressed STOP", action="stop", target=target, outcome=outcome)
