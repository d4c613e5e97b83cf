"""Routes of records: points and blows of the hammer, sine records of the tester, and the waveform of each."""

from collections import Counter
from typing import Annotated

from fastapi import APIRouter, Query, Response

from api.service.access import ReaderContext
from api.service.context import Rig, Services
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import IdempotentRequest, idempotent
from api.service.pages import Page, Paging
from api.service.parameters import RunNumber, document, first_of, number_of
from api.service.problems import problems
from jointlab.documents.fields import LARGEST_EXACT, Why
from jointlab.documents.runs import BlowDocument, PointDocument, SineRecordDocument, Trace, WaveformDocument
from store.errors import NotFoundError
from store.measurements.blows import Blow, get_blow, list_blows
from store.measurements.sine_records import SineRecord, get_sine_record, list_sine_records
from store.states import Scope
from store.waveforms.waveform import WaveformReference

router = APIRouter(tags=["blows and points"], route_class=TaggedRoute)
BLOW = first_of("blow_id", "blows-and-points-blow", "blows-and-points-blow-waveform", "blows-and-points-withdraw")
RECORD = first_of("record_id", "blows-and-points-sine-record", "blows-and-points-sine-waveform")
BlowNumber = Annotated[int, number_of("blow")]
RecordNumber = Annotated[int, number_of("sine record", LARGEST_EXACT)]
Every = Annotated[int, Query(ge=1, le=10_000, description="only every n-th sample, for a quick view")]


@router.get("/runs/{run_id}/points", responses=problems(404))
def points(context: ReaderContext, paging: Paging, run_id: RunNumber) -> Page[PointDocument]:
    """The points that were struck, in the order of measuring."""
    blows = context.catalogue.read(list_blows, run_id)
    counts = Counter((blow.set_number, str(blow.point), blow.accepted) for blow in blows)
    places = dict.fromkeys((blow.set_number, str(blow.point)) for blow in blows)
    struck = [
        PointDocument(
            set_number=number, point=point, accepted=counts[number, point, True], refused=counts[number, point, False]
        )
        for number, point in places
    ]
    return paging.of_whole(struck)


@router.get("/runs/{run_id}/blows", responses=problems(404) | BLOW)
def blows(
    context: ReaderContext,
    paging: Paging,
    run_id: RunNumber,
    accepted: Annotated[bool | None, Query(description="only accepted ones, or only refused ones")] = None,
) -> Page[BlowDocument]:
    """The blows of a run in the order of measuring."""
    with context.catalogue.reading() as session:
        found = [blow for blow in list_blows(session, run_id) if accepted in (None, blow.accepted)]
    return paging.of_whole([_blow(each) for each in found])


@router.get("/blows/{blow_id}", responses=problems(404))
def blow(context: ReaderContext, blow_id: BlowNumber) -> BlowDocument:
    """One blow."""
    with context.catalogue.reading() as session:
        return _blow(get_blow(session, blow_id))


@router.post("/blows/{blow_id}/withdraw", response_model=BlowDocument, responses=problems(404, 409))
def withdraw(
    request: Annotated[IdempotentRequest, idempotent("withdraw blow", "blow {blow_id}", Scope.CONTROL)],
    rig: Rig,
    blow_id: BlowNumber,
    why: Why,
) -> Response:
    """Withdraw an accepted blow: it no longer counts, and a hammer session that still lasts repeats its point."""

    def take_back() -> BlowDocument:
        return _blow(rig.withdrawals.withdraw(blow_id, why.reason, request.caller.name))

    return request.once(take_back, reason=why.reason)


@router.get("/blows/{blow_id}/waveform", responses=problems(404, 500))
def blow_waveform(context: ReaderContext, blow_id: BlowNumber, every: Every = 1) -> WaveformDocument:
    """The records of force and acceleration of a blow."""
    return _waveform(context, context.catalogue.read(get_blow, blow_id).waveform, f"blow {blow_id}", every)


@router.get("/runs/{run_id}/sine-records", responses=problems(404) | RECORD)
def sine_records(
    context: ReaderContext,
    paging: Paging,
    run_id: RunNumber,
    specimen: Annotated[str | None, Query(max_length=100)] = None,
    configuration: Annotated[str | None, Query(max_length=100)] = None,
) -> Page[SineRecordDocument]:
    """The sine records of a run in the order of measuring."""
    with context.catalogue.reading() as session:
        found = [
            record
            for record in list_sine_records(session, run_id)
            if specimen in (None, record.specimen) and configuration in (None, record.configuration)
        ]
    return paging.of_whole([_sine_record(each) for each in found])


@router.get("/sine-records/{record_id}", responses=problems(404))
def sine_record(context: ReaderContext, record_id: RecordNumber) -> SineRecordDocument:
    """One sine record."""
    with context.catalogue.reading() as session:
        return _sine_record(get_sine_record(session, record_id))


@router.get("/sine-records/{record_id}/waveform", responses=problems(404, 500))
def sine_waveform(context: ReaderContext, record_id: RecordNumber, every: Every = 1) -> WaveformDocument:
    """The records of displacement and force of a steady sine."""
    found = context.catalogue.read(get_sine_record, record_id)
    return _waveform(context, found.waveform, f"sine record {record_id}", every)


def _blow(blow: Blow) -> BlowDocument:
    return document(BlowDocument, blow, point=str(blow.point), has_waveform=blow.waveform is not None)


def _sine_record(record: SineRecord) -> SineRecordDocument:
    return document(SineRecordDocument, record, has_waveform=record.waveform is not None)


def _waveform(context: Services, reference: WaveformReference | None, record: str, every: int) -> WaveformDocument:
    if reference is None:
        raise NotFoundError(f"{record} was imported without its waveform")
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
