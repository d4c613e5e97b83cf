"""The instruments that were ever used or calibrated, and their calibrations; a new calibration is a new row."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date, datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.errors import NotFoundError
from store.instruments import Instrument, calibration_id
from store.models.measurements import CalibrationRow, InstrumentRow


@dataclass(frozen=True)
class KnownInstrument:
    """What has a serial number."""

    id: int
    kind: str
    model: str
    serial: str
    details: dict[str, Any]


@dataclass(frozen=True)
class Calibration:
    """One calibration; `sensitivity` as the certificate gives it, in `sensitivity_unit`. Stored at `stored_at`, UTC."""

    id: int
    instrument_id: int
    calibrated_on: date | None
    sensitivity: float | None
    sensitivity_unit: str | None
    stored_at: datetime


def get_instrument(session: Session, instrument_id: int) -> KnownInstrument:
    """One instrument.

    Raises:
        NotFoundError: there is no such instrument.
    """
    return _instrument(_row(session, instrument_id))


def list_known_instruments(
    session: Session, *, kind: str | None = None, after: int = 0, limit: int = 100
) -> list[KnownInstrument]:
    """Instruments in the order of storing; `after` a number, to go on with a list."""
    query = select(InstrumentRow).where(InstrumentRow.id > after).order_by(InstrumentRow.id).limit(limit)
    if kind is not None:
        query = query.filter_by(kind=kind)
    return [_instrument(row) for row in session.scalars(query)]


def list_calibrations(session: Session, instrument_id: int) -> list[Calibration]:
    """The calibrations of an instrument, newest first.

    Raises:
        NotFoundError: there is no such instrument.
    """
    _row(session, instrument_id)
    query = select(CalibrationRow).filter_by(instrument_id=instrument_id).order_by(CalibrationRow.id.desc())
    return [_calibration(row) for row in session.scalars(query)]


def add_calibration(
    session: Session, instrument_id: int, calibrated_on: date, sensitivity: float, sensitivity_unit: str
) -> Calibration:
    """Store a calibration beside the older ones; the same one is stored once.

    Raises:
        NotFoundError: there is no such instrument.
    """
    row = _row(session, instrument_id)
    number = calibration_id(
        session, Instrument(row.kind, row.model, row.serial, calibrated_on, sensitivity, sensitivity_unit)
    )
    return _calibration(session.get_one(CalibrationRow, number))


def _row(session: Session, instrument_id: int) -> InstrumentRow:
    row = session.get(InstrumentRow, instrument_id)
    if row is None:
        raise NotFoundError(f"there is no instrument {instrument_id}")
    return row


def _instrument(row: InstrumentRow) -> KnownInstrument:
    return KnownInstrument(row.id, row.kind, row.model, row.serial, row.details)


def _calibration(row: CalibrationRow) -> Calibration:
    return Calibration(
        row.id, row.instrument_id, row.calibrated_on, row.sensitivity, row.sensitivity_unit, row.created_at
    )
