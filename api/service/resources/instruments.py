"""Instruments with their calibrations, and the channel table that the next run is measured with."""

from __future__ import annotations

from datetime import date, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, ConfigDict, Field

from api.service.access import Reader
from api.service.context import Context
from api.service.documents import Words, number_of
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import Act, acting
from api.service.links import first_of
from api.service.pages import Cursor, Limit, Page, number_from, page_of, page_of_whole
from api.service.problems import problems
from store.calibrations import (
    Calibration,
    KnownInstrument,
    add_calibration,
    get_instrument,
    list_calibrations,
    list_known_instruments,
)
from store.states import Scope

router = APIRouter(prefix="/instruments", tags=["instruments"], route_class=TaggedRoute)
Number = Annotated[int, number_of("instrument")]


class InstrumentDocument(BaseModel):
    """What has a serial number."""

    id: int
    kind: str
    model: str
    serial: str
    details: dict[str, Any]

    @classmethod
    def of(cls, found: KnownInstrument) -> InstrumentDocument:
        """What is shown of an instrument."""
        return cls(**vars(found))


class CalibrationDocument(BaseModel):
    """One calibration, as its certificate gives it."""

    id: int
    instrument_id: int
    calibrated_on: date | None
    sensitivity: float | None = Field(description="in `sensitivity_unit`")
    sensitivity_unit: str | None
    stored_at: datetime

    @classmethod
    def of(cls, found: Calibration) -> CalibrationDocument:
        """What is shown of a calibration."""
        return cls(**vars(found))


class NewCalibration(BaseModel):
    """What a certificate says."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    calibrated_on: date
    sensitivity: float = Field(gt=0, description="in `sensitivity_unit`")
    sensitivity_unit: Words


@router.get("", responses=problems(401, 403) | first_of("instrument_id", "instruments-get", "instruments-calibrate"))
def list_(
    _who: Reader,
    context: Context,
    kind: Annotated[Words | None, Query(description="tester, hammer, thermometer, ...")] = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Page[InstrumentDocument]:
    """List every instrument that was ever used, in the order of first use."""
    with context.catalogue.reading() as session:
        found = list_known_instruments(session, kind=kind, after=number_from(cursor) or 0, limit=limit + 1)
    return page_of([InstrumentDocument.of(each) for each in found], limit, lambda each: each.id)


@router.get("/{instrument_id}", responses=problems(401, 403, 404))
def get(_who: Reader, context: Context, instrument_id: Number) -> InstrumentDocument:
    """One instrument."""
    with context.catalogue.reading() as session:
        return InstrumentDocument.of(get_instrument(session, instrument_id))


@router.get("/{instrument_id}/calibrations", responses=problems(401, 403, 404))
def calibrations(
    _who: Reader, context: Context, instrument_id: Number, limit: Limit = 100, cursor: Cursor = None
) -> Page[CalibrationDocument]:
    """The calibrations of an instrument, newest first."""
    with context.catalogue.reading() as session:
        found = list_calibrations(session, instrument_id)
    return page_of_whole([CalibrationDocument.of(each) for each in found], limit, cursor)


@router.post(
    "/{instrument_id}/calibrations",
    status_code=201,
    response_model=CalibrationDocument,
    responses=problems(401, 403, 404, 409),
)
def calibrate(
    act: Annotated[Act, acting("add calibration", "instrument {instrument_id}", Scope.ENGINEER)],
    context: Context,
    instrument_id: Number,
    given: NewCalibration,
) -> Response:
    """Store what a new certificate says; it is in force when the channel table of the configuration says so, too."""

    def add() -> CalibrationDocument:
        with context.catalogue.writing() as session:
            return CalibrationDocument.of(
                add_calibration(session, instrument_id, given.calibrated_on, given.sensitivity, given.sensitivity_unit)
            )

    return act.once(add, 201, **given.model_dump(mode="json"))
