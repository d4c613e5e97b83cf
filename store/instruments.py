"""Instruments, their calibrations, and the channels of a run."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import date
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.models.measurements import CalibrationRow, ChannelRow, InstrumentRow, RunInstrumentRow


@dataclass(frozen=True)
class Instrument:
    """What has a serial number, with the calibration that was valid.

    Attributes:
        kind: accelerometer, hammer, tester, thermometer, chassis, ...
        calibrated_on: None for what is not calibrated, or imported without a date.
        sensitivity: as the certificate gives it, in `sensitivity_unit`.
        details: what else identifies it, such as the firmware or the version of the register map.
    """

    kind: str
    model: str
    serial: str
    calibrated_on: date | None = None
    sensitivity: float | None = None
    sensitivity_unit: str | None = None
    details: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class StoredChannel:
    """One input as it is set during a run.

    Attributes:
        physical: the terminal, such as cDAQ1Mod1/ai0.
        kind: force, acceleration, voltage, ...
        unit: physical unit of minimum and maximum.
        sensitivity: volts per physical unit.
        excitation_current: A, or None without IEPE.
        instrument: what is connected.
    """

    name: str
    physical: str
    kind: str
    unit: str
    sensitivity: float
    minimum: float
    maximum: float
    excitation_current: float | None
    instrument: Instrument


def calibration_id(session: Session, instrument: Instrument) -> int:
    """Number of the instrument's calibration; both rows are made where they are new."""
    row = session.scalars(
        select(InstrumentRow).filter_by(kind=instrument.kind, model=instrument.model, serial=instrument.serial)
    ).one_or_none()
    if row is None:
        row = InstrumentRow(
            kind=instrument.kind, model=instrument.model, serial=instrument.serial, details=instrument.details
        )
        session.add(row)
        session.flush()
    known = session.scalars(
        select(CalibrationRow.id).where(
            CalibrationRow.instrument_id == row.id,
            CalibrationRow.calibrated_on.is_not_distinct_from(instrument.calibrated_on),
            CalibrationRow.sensitivity.is_not_distinct_from(instrument.sensitivity),
        )
    ).first()
    if known is not None:
        return known
    calibration = CalibrationRow(
        instrument_id=row.id,
        calibrated_on=instrument.calibrated_on,
        sensitivity=instrument.sensitivity,
        sensitivity_unit=instrument.sensitivity_unit,
    )
    session.add(calibration)
    session.flush()
    return calibration.id


def add_channels(session: Session, run_id: int, channels: tuple[StoredChannel, ...]) -> None:
    """Store how the channels of a run are set."""
    session.add_all(
        ChannelRow(
            run_id=run_id,
            name=channel.name,
            physical=channel.physical,
            kind=channel.kind,
            unit=channel.unit,
            sensitivity=channel.sensitivity,
            minimum=channel.minimum,
            maximum=channel.maximum,
            excitation_current=channel.excitation_current,
            calibration_id=calibration_id(session, channel.instrument),
        )
        for channel in channels
    )


def list_channels(session: Session, run_id: int) -> list[StoredChannel]:
    """The channels of a run, by name."""
    rows = session.scalars(select(ChannelRow).filter_by(run_id=run_id).order_by(ChannelRow.name))
    return [
        StoredChannel(
            name=row.name,
            physical=row.physical,
            kind=row.kind,
            unit=row.unit,
            sensitivity=row.sensitivity,
            minimum=row.minimum,
            maximum=row.maximum,
            excitation_current=row.excitation_current,
            instrument=_instrument(row.calibration),
        )
        for row in rows
    ]


def list_instruments(session: Session, run_id: int) -> list[Instrument]:
    """The instruments of a run that are not on a channel, by kind: tester, thermometer, chassis."""
    rows = session.scalars(
        select(CalibrationRow)
        .join(RunInstrumentRow, RunInstrumentRow.calibration_id == CalibrationRow.id)
        .where(RunInstrumentRow.run_id == run_id)
    )
    return sorted((_instrument(row) for row in rows), key=lambda instrument: (instrument.kind, instrument.serial))


def _instrument(row: CalibrationRow) -> Instrument:
    return Instrument(
        kind=row.instrument.kind,
        model=row.instrument.model,
        serial=row.instrument.serial,
        calibrated_on=row.calibrated_on,
        sensitivity=row.sensitivity,
        sensitivity_unit=row.sensitivity_unit,
        details=row.instrument.details,
    )
