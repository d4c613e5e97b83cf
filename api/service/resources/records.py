"""What was recorded: points and blows of the hammer, sine records of the tester, and the waveform of each."""

from __future__ import annotations

from collections import Counter
from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field

from api.service.access import Reader
from api.service.context import Context, Rig, Services
from api.service.documents import RunNumber, Why, number_of
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import Act, acting
from api.service.links import first_of
from api.service.pages import Cursor, Limit, Page, page_of_whole
from api.service.problems import problems
from store.blows import Blow, get_blow, list_blows
from store.errors import NotFoundError
from store.quantity import quantity
from store.sine_records import SineRecord, get_sine_record, list_sine_records
from store.states import Scope
from store.waveform import WaveformReference

router = APIRouter(tags=["blows and points"], route_class=TaggedRoute)
BLOW = first_of("blow_id", "blows-and-points-blow", "blows-and-points-blow-waveform", "blows-and-points-withdraw")
RECORD = first_of("record_id", "blows-and-points-sine-record", "blows-and-points-sine-waveform")
Every = Annotated[int, Query(ge=1, le=10_000, description="only every so many-th sample, for a quick look")]


class PointDocument(BaseModel):
    """A point struck in a set, and how many of its blows count."""

    set_number: int
    point: str = Field(description="node and direction, such as 3y")
    accepted: int
    refused: int


class BlowDocument(BaseModel):
    """One blow, accepted or refused with its reason; times are UTC."""

    id: int
    set_number: int
    point: str
    number: int = Field(description="counts the blows at the point, refused ones too, from 1")
    accepted: bool
    reason: str | None
    peak_force: Annotated[float | None, quantity("N")]
    temperature_c: Annotated[float | None, quantity("degC")]
    struck_at: datetime | None
    has_waveform: bool

    @classmethod
    def of(cls, blow: Blow) -> BlowDocument:
        """What is shown of a blow."""
        same = set(cls.model_fields) - {"point", "has_waveform"}
        return cls(
            **{name: getattr(blow, name) for name in same},
            point=str(blow.point),
            has_waveform=blow.waveform is not None,
        )


class SineRecordDocument(BaseModel):
    """One steady sine of the tester as it was recorded; times are UTC."""

    id: int
    order_number: int = Field(description="the order of measuring, from 1")
    specimen: str
    configuration: str
    commanded_pp_mm: Annotated[float, quantity("mm", "peak to peak")]
    reached_pp_mm: Annotated[float | None, quantity("mm", "peak to peak")]
    frequency: Annotated[float, quantity("Hz")]
    elapsed: Annotated[float, quantity("s", "since the run began")]
    recorded_at: datetime | None
    temperature_c: Annotated[float | None, quantity("degC")]
    has_waveform: bool

    @classmethod
    def of(cls, record: SineRecord) -> SineRecordDocument:
        """What is shown of a sine record."""
        same = set(cls.model_fields) - {"has_waveform"}
        return cls(**{name: getattr(record, name) for name in same}, has_waveform=record.waveform is not None)


class Trace(BaseModel):
    """What one channel recorded, in its unit."""

    name: str
    unit: str
    values: list[float]


class WaveformDocument(BaseModel):
    """One record of all channels on one clock, verified against its checksum."""

    sample_rate: Annotated[float, quantity("Hz", "of the samples given here")]
    started_at: datetime | None
    trigger_index: int | None = Field(description="of the first sample given here that is not before the trigger")
    overloaded: list[str]
    traces: list[Trace]


@router.get("/runs/{run_id}/points", responses=problems(401, 403, 404))
def points(
    _who: Reader, context: Context, run_id: RunNumber, limit: Limit = 100, cursor: Cursor = None
) -> Page[PointDocument]:
    """The points that were struck, in the order of measuring."""
    with context.catalogue.reading() as session:
        blows = list_blows(session, run_id)
    counts = Counter((blow.set_number, str(blow.point), blow.accepted) for blow in blows)
    places = dict.fromkeys((blow.set_number, str(blow.point)) for blow in blows)
    struck = [
        PointDocument(
            set_number=number, point=point, accepted=counts[number, point, True], refused=counts[number, point, False]
        )
        for number, point in places
    ]
    return page_of_whole(struck, limit, cursor)


@router.get("/runs/{run_id}/blows", responses=problems(401, 403, 404) | BLOW)
def blows(
    _who: Reader,
    context: Context,
    run_id: RunNumber,
    accepted: Annotated[bool | None, Query(description="only these that count, or only refused ones")] = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Page[BlowDocument]:
    """The blows of a run in the order of measuring."""
    with context.catalogue.reading() as session:
        found = [blow for blow in list_blows(session, run_id) if accepted in (None, blow.accepted)]
    return page_of_whole([BlowDocument.of(blow) for blow in found], limit, cursor)


@router.get("/blows/{blow_id}", responses=problems(401, 403, 404))
def blow(_who: Reader, context: Context, blow_id: Annotated[int, number_of("blow")]) -> BlowDocument:
    """One blow."""
    with context.catalogue.reading() as session:
        return BlowDocument.of(get_blow(session, blow_id))


@router.post("/blows/{blow_id}/withdraw", response_model=BlowDocument, responses=problems(401, 403, 404, 409))
def withdraw(
    act: Annotated[Act, acting("withdraw blow", "blow {blow_id}", Scope.CONTROL)],
    rig: Rig,
    blow_id: Annotated[int, number_of("blow")],
    why: Why,
) -> Response:
    """Take an accepted blow back: it counts no more, and a session that is still on strikes its point once more."""

    def take_back() -> BlowDocument:
        return BlowDocument.of(rig.withdraw_blow(blow_id, why.reason, act.who.name))

    return act.once(take_back, reason=why.reason)


@router.get("/blows/{blow_id}/waveform", responses=problems(401, 403, 404, 500))
def blow_waveform(
    _who: Reader, context: Context, blow_id: Annotated[int, number_of("blow")], every: Every = 1
) -> WaveformDocument:
    """What force and accelerometer recorded of a blow."""
    with context.catalogue.reading() as session:
        found = get_blow(session, blow_id)
    return _waveform(context, found.waveform, f"blow {blow_id}", every)


@router.get("/runs/{run_id}/sine-records", responses=problems(401, 403, 404) | RECORD)
def sine_records(
    _who: Reader,
    context: Context,
    run_id: RunNumber,
    specimen: Annotated[str | None, Query(max_length=100)] = None,
    configuration: Annotated[str | None, Query(max_length=100)] = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Page[SineRecordDocument]:
    """The sine records of a run in the order of measuring."""
    with context.catalogue.reading() as session:
        found = [
            record
            for record in list_sine_records(session, run_id)
            if specimen in (None, record.specimen) and configuration in (None, record.configuration)
        ]
    return page_of_whole([SineRecordDocument.of(record) for record in found], limit, cursor)


@router.get("/sine-records/{record_id}", responses=problems(401, 403, 404))
def sine_record(
    _who: Reader, context: Context, record_id: Annotated[int, number_of("sine record")]
) -> SineRecordDocument:
    """One sine record."""
    with context.catalogue.reading() as session:
        return SineRecordDocument.of(get_sine_record(session, record_id))


@router.get("/sine-records/{record_id}/waveform", responses=problems(401, 403, 404, 500))
def sine_waveform(
    _who: Reader, context: Context, record_id: Annotated[int, number_of("sine record")], every: Every = 1
) -> WaveformDocument:
    """What displacement and force recorded of a steady sine."""
    with context.catalogue.reading() as session:
        found = get_sine_record(session, record_id)
    return _waveform(context, found.waveform, f"sine record {record_id}", every)


def _waveform(context: Services, reference: WaveformReference | None, what: str, every: int) -> WaveformDocument:
    if reference is None:
        raise NotFoundError(f"{what} was imported without its waveform")
    found = context.catalogue.waveforms.read(reference)
    return WaveformDocument(
        sample_rate=found.sample_rate / every,
        started_at=found.started_at,
        trigger_index=None if found.trigger_index is None else -(-found.trigger_index // every),
        overloaded=list(found.overloaded),
        traces=[
            Trace(name=channel.name, unit=channel.unit, values=found.value(channel.name)[::every].tolist())
            for channel in found.channels
        ],
    )
