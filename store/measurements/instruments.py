"""Instruments, their calibrations, and the channels of a run; a new calibration is a new row."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.instrument import Instrument, StoredChannel
from store.models.measurements import CalibrationRow, ChannelRow, InstrumentRow, RunInstrumentRow
from store.models.rows import equal, found_or_added, from_row, get_row, to_columns


@dataclass(frozen=True)
class KnownInstrument:
    """An instrument that was used or calibrated at some time."""

    id: int
    kind: str
    model: str
    serial: str
    details: dict[str, Any]


@dataclass(frozen=True)
class InstrumentCalibration:
    """One calibration; `sensitivity` as the certificate gives it, in `sensitivity_unit`. Stored at `stored_at`, UTC.

    Its `uncertainty` is relative and expanded (k = 2); `due_on` is the day until which it is valid.
    """

    id: int
    instrument_id: int
    calibrated_on: date | None
    sensitivity: float | None
    sensitivity_unit: str | None
    uncertainty: float | None
    certificate: str | None
    due_on: date | None
    stored_at: datetime


def calibration_id(session: Session, instrument: Instrument) -> int:
    """Number of the instrument's calibration; a new instrument and a new calibration get a row."""
    query = select(InstrumentRow).filter_by(kind=instrument.kind, model=instrument.model, serial=instrument.serial)
    row, _ = found_or_added(session, query, lambda: InstrumentRow(**to_columns(instrument, InstrumentRow)))
    columns = to_columns(instrument, CalibrationRow)
    same = [getattr(CalibrationRow, name).is_not_distinct_from(value) for name, value in columns.items()]
    known = select(CalibrationRow).where(CalibrationRow.instrument_id == row.id, *same).order_by(CalibrationRow.id)
    return found_or_added(session, known, lambda: CalibrationRow(instrument_id=row.id, **columns))[0].id


def add_channels(session: Session, run_id: int, channels: Sequence[StoredChannel]) -> None:
    """Store the settings of a run's channels."""
    for channel in channels:
        number = calibration_id(session, channel.instrument)
        session.add(ChannelRow(run_id=run_id, calibration_id=number, **to_columns(channel, ChannelRow)))


def list_channels(session: Session, run_id: int) -> list[StoredChannel]:
    """The channels of a run, by name."""
    rows = session.scalars(select(ChannelRow).filter_by(run_id=run_id).order_by(ChannelRow.name))
    return [from_row(StoredChannel, row, instrument=_instrument(row.calibration)) for row in rows]


def list_instruments(session: Session, run_id: int) -> list[Instrument]:
    """The instruments of a run that are on no channel, by kind: tester, thermometer, chassis."""
    rows = session.execute(
        select(CalibrationRow, RunInstrumentRow.details)
        .join(RunInstrumentRow, RunInstrumentRow.calibration_id == CalibrationRow.id)
        .where(RunInstrumentRow.run_id == run_id)
    )
    found = [_instrument(row, details) for row, details in rows]
    return sorted(found, key=lambda instrument: (instrument.kind, instrument.serial))


def get_instrument(session: Session, instrument_id: int) -> KnownInstrument:
    """One instrument, or NotFoundError."""
    return from_row(KnownInstrument, _row(session, instrument_id))


def list_known_instruments(
    session: Session, *, kind: str | None = None, after: int = 0, limit: int = 100
) -> list[KnownInstrument]:
    """Instruments in the order of storing; a page begins after the number `after`."""
    query = select(InstrumentRow).where(InstrumentRow.id > after, *equal(InstrumentRow, kind=kind))
    return [from_row(KnownInstrument, row) for row in session.scalars(query.order_by(InstrumentRow.id).limit(limit))]


def list_calibrations(session: Session, instrument_id: int) -> list[InstrumentCalibration]:
    """The calibrations of an instrument, newest first; NotFoundError where there is no such instrument."""
    _row(session, instrument_id)
    query = select(CalibrationRow).filter_by(instrument_id=instrument_id).order_by(CalibrationRow.id.desc())
    return [_calibration(row) for row in session.scalars(query)]


def add_calibration(
    session: Session,
    instrument_id: int,
    calibrated_on: date,
    sensitivity: float,
    sensitivity_unit: str,
    uncertainty: float | None = None,
    certificate: str | None = None,
    due_on: date | None = None,
) -> InstrumentCalibration:
    """Store a calibration beside the older ones; the same one is stored once.

    Raises NotFoundError if there is no such instrument.
    """
    row = _row(session, instrument_id)
    calibrated = Instrument(
        row.kind, row.model, row.serial, calibrated_on, sensitivity, sensitivity_unit,
        uncertainty=uncertainty, certificate=certificate, due_on=due_on,
    )  # fmt: skip
    return _calibration(session.get_one(CalibrationRow, calibration_id(session, calibrated)))


def _row(session: Session, instrument_id: int) -> InstrumentRow:
    return get_row(session, InstrumentRow, instrument_id, "instrument")


def _instrument(row: CalibrationRow, details: dict[str, Any] | None = None) -> Instrument:
    """The instrument with what it said of itself, by default to the first run that used it."""
    one = row.instrument
    known = one.details if details is None else details
    return from_row(Instrument, row, kind=one.kind, model=one.model, serial=one.serial, details=known)


def _calibration(row: CalibrationRow) -> InstrumentCalibration:
    return from_row(InstrumentCalibration, row, stored_at=row.created_at)
