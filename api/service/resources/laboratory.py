"""Routes of the laboratory: instruments with calibrations, channel tables, and specimens."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from analysis.interval import Estimate
from api.service.access import Reader, ReaderContext
from api.service.context import Rig
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import IdempotentRequest, idempotent
from api.service.pages import Page, Paging
from api.service.parameters import OptionalArticle, RunNumber, document, first_of, number_of
from api.service.problems import problems
from jointlab.documents.fields import OneLine
from jointlab.documents.history import ChangeDocument, HistoryDocument, HistoryResult
from jointlab.documents.laboratory import (
    CalibrationDocument,
    ChannelDocument,
    InstrumentDocument,
    NewCalibration,
    SpecimenDocument,
)
from jointlab.documents.stiffness import HIGHEST_FREQUENCY, LARGEST_AMPLITUDE
from jointlab.specimen_history import history_of
from rig.instruments import stored_channel
from store.instrument import StoredChannel
from store.measurements.instruments import (
    add_calibration,
    get_instrument,
    list_calibrations,
    list_channels,
    list_known_instruments,
)
from store.measurements.runs import get_run
from store.measurements.specimens import get_specimen, list_specimens
from store.states import ConfigurationName, Scope

instruments = APIRouter(prefix="/instruments", tags=["instruments"], route_class=TaggedRoute)
channels = APIRouter(tags=["channels"], route_class=TaggedRoute)
specimens = APIRouter(prefix="/specimens", tags=["specimens"], route_class=TaggedRoute)
InstrumentNumber = Annotated[int, number_of("instrument")]


@instruments.get(
    "", name="list_", responses=problems() | first_of("instrument_id", "instruments-get", "instruments-calibrate")
)
def list_instruments(
    context: ReaderContext,
    paging: Paging,
    kind: Annotated[OneLine | None, Query(description="tester, hammer, thermometer, ...")] = None,
) -> Page[InstrumentDocument]:
    """List every instrument that was ever used, in the order of first use."""
    found = context.catalogue.read(list_known_instruments, kind=kind, after=paging.number or 0, limit=paging.rows)
    return paging.of_rows([document(InstrumentDocument, each) for each in found])


@instruments.get("/{instrument_id}", name="get", responses=problems(404))
def one_instrument(context: ReaderContext, instrument_id: InstrumentNumber) -> InstrumentDocument:
    """One instrument."""
    with context.catalogue.reading() as session:
        return document(InstrumentDocument, get_instrument(session, instrument_id))


@instruments.get("/{instrument_id}/calibrations", name="calibrations", responses=problems(404))
def calibrations_of_instrument(
    context: ReaderContext, paging: Paging, instrument_id: InstrumentNumber
) -> Page[CalibrationDocument]:
    """The calibrations of an instrument, newest first."""
    found = context.catalogue.read(list_calibrations, instrument_id)
    return paging.of_whole([document(CalibrationDocument, each) for each in found])


@instruments.post(
    "/{instrument_id}/calibrations", status_code=201, response_model=CalibrationDocument, responses=problems(404, 409)
)
def calibrate(
    request: Annotated[IdempotentRequest, idempotent("add calibration", "instrument {instrument_id}", Scope.ENGINEER)],
    instrument_id: InstrumentNumber,
    given: NewCalibration,
) -> Response:
    """Store a new certificate; it comes into force when the channel table of the configuration has it, too."""

    def add() -> CalibrationDocument:
        with request.services.catalogue.writing() as session:
            row = add_calibration(session, instrument_id, **given.model_dump())
        return document(CalibrationDocument, row)

    return request.once(add, 201, **given.model_dump(mode="json"))


@channels.get("/channels", responses=problems(409))
def configured(_caller: Reader, rig: Rig, paging: Paging) -> Page[ChannelDocument]:
    """The channel table that the next run is measured with; it comes from the configuration."""
    return paging.of_whole([_channel(stored_channel(channel)) for channel in rig.instruments.channels])


@channels.get("/runs/{run_id}/channels", name="of_run", responses=problems(404))
def channels_of_run(context: ReaderContext, paging: Paging, run_id: RunNumber) -> Page[ChannelDocument]:
    """The channels of a run as they were set, by name."""
    with context.catalogue.reading() as session:
        get_run(session, run_id)
        found = list_channels(session, run_id)
    return paging.of_whole([_channel(channel) for channel in found])


@specimens.get("", name="list_", responses=problems() | first_of("specimen_id", "specimens-get", "specimens-history"))
def list_all_specimens(
    context: ReaderContext, paging: Paging, article: OptionalArticle = None
) -> Page[SpecimenDocument]:
    """List specimens in the order of first use."""
    found = context.catalogue.read(list_specimens, article=article, after=paging.number or 0, limit=paging.rows)
    return paging.of_rows([document(SpecimenDocument, each) for each in found])


@specimens.get("/{specimen_id}", name="get", responses=problems(404))
def one_specimen(context: ReaderContext, specimen_id: Annotated[int, number_of("specimen")]) -> SpecimenDocument:
    """One specimen."""
    with context.catalogue.reading() as session:
        return document(SpecimenDocument, get_specimen(session, specimen_id))


@specimens.get("/{specimen_id}/history", name="history", responses=problems(404))
def history_of_specimen(
    context: ReaderContext,
    specimen_id: Annotated[int, number_of("specimen")],
    configuration: Annotated[
        ConfigurationName | None, Query(description="that of most runs where none is given")
    ] = None,
    amplitude_pp_mm: Annotated[
        float | None, Query(gt=0, le=LARGEST_AMPLITUDE, description="peak to peak, commanded, mm")
    ] = None,
    frequency: Annotated[float | None, Query(gt=0, le=HIGHEST_FREQUENCY, description="commanded, Hz")] = None,
) -> HistoryDocument:
    """A specimen over its runs at one nominal point of the tester, with its trend; 404 says where it was measured."""
    with context.catalogue.reading() as session:
        specimen = get_specimen(session, specimen_id)
        found = history_of(session, specimen.article, specimen.name, configuration, amplitude_pp_mm, frequency)
        return HistoryDocument(
            article=specimen.article,
            specimen=specimen.name,
            **found.point._asdict(),
            days=found.days,
            stiffness_change=_change(found.stiffness_change),
            loss_factor_change=_change(found.loss_factor_change),
            results=[document(HistoryResult, each) for each in found.results],
        )


def _change(found: Estimate | None) -> ChangeDocument | None:
    return None if found is None else ChangeDocument(share=found.value, ci95=found.interval())


def _channel(channel: StoredChannel) -> ChannelDocument:
    sensor = channel.instrument
    of_sensor = ("serial", "calibrated_on", "uncertainty", "certificate", "due_on")
    return document(ChannelDocument, channel, **{name: getattr(sensor, name) for name in of_sensor})
