"""Tables of measurements, instruments and specimens: rows are written once and never changed."""

from datetime import date, datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from store.models.base import WIDE, Base, Checksummed, Recorded


class SpecimenRow(Recorded, Checksummed, Base):
    """The cylinders of one joint, or a known piece; `article` is their test article, `name` the joint."""

    __tablename__ = "specimens"
    __table_args__ = (UniqueConstraint("article", "name"),)

    article: Mapped[str]
    name: Mapped[str]
    description: Mapped[str | None]


class InstrumentRow(Recorded, Checksummed, Base):
    """A sensor, a tester, a thermometer: an instrument with a serial number."""

    __tablename__ = "instruments"
    __table_args__ = (UniqueConstraint("kind", "model", "serial"),)

    kind: Mapped[str]
    model: Mapped[str]
    serial: Mapped[str]
    details: Mapped[dict[str, Any]]


class CalibrationRow(Recorded, Checksummed, Base):
    """One calibration of an instrument; a new one is a new row."""

    __tablename__ = "calibrations"
    __table_args__ = (Index(None, "instrument_id"),)

    instrument_id: Mapped[int] = mapped_column(ForeignKey("instruments.id"))
    calibrated_on: Mapped[date | None]
    sensitivity: Mapped[float | None]
    sensitivity_unit: Mapped[str | None]
    uncertainty: Mapped[float | None]
    certificate: Mapped[str | None]
    due_on: Mapped[date | None]
    instrument: Mapped[InstrumentRow] = relationship()


class CommissioningRecordRow(Recorded, Checksummed, Base):
    """An examination of a rig: who answers for it, what was checked, with which instruments, and the verdict."""

    __tablename__ = "commissioning_records"
    __table_args__ = (Index(None, "rig", "id"),)

    rig: Mapped[str]
    place: Mapped[str]
    who: Mapped[str]
    verdict: Mapped[str]
    checks: Mapped[dict[str, Any]]
    instruments: Mapped[dict[str, Any]]


class SetupAmendmentRow(Recorded, Checksummed, Base):
    """A corrected description of how a run was measured, in force since; that of the measurement itself stays."""

    __tablename__ = "setup_amendments"
    __table_args__ = (UniqueConstraint("run_id", "version"),)

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"))
    version: Mapped[int]
    setup: Mapped[dict[str, Any]]
    reason: Mapped[str]
    who: Mapped[str]


class RunRow(Recorded, Checksummed, Base):
    """One measurement or import, from its start to its end; `rig` is NULL where it was not measured on a rig here."""

    __tablename__ = "runs"
    __table_args__ = tuple(Index(None, name, "id") for name in ("state", "kind", "article", "started_at", "rig"))

    kind: Mapped[str]
    state: Mapped[str]
    title: Mapped[str]
    article: Mapped[str]
    started_at: Mapped[datetime]
    finished_at: Mapped[datetime | None]
    reason: Mapped[str | None]
    setup: Mapped[dict[str, Any]]
    sequence: Mapped[dict[str, Any]]
    configuration_hash: Mapped[str]
    waveform_file: Mapped[str] = mapped_column(unique=True)
    rig: Mapped[str | None]
    automatic: Mapped[bool | None]
    amendments: Mapped[list[SetupAmendmentRow]] = relationship(order_by=SetupAmendmentRow.version)


class RunEventRow(Recorded, Checksummed, Base):
    """A change of a run's state: a start, an end, a resumption. The history of a run is never overwritten."""

    __tablename__ = "run_events"
    __table_args__ = (Index(None, "run_id"),)

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"))
    state: Mapped[str]
    reason: Mapped[str | None]
    who: Mapped[str | None]
    happened_at: Mapped[datetime]


class RunInstrumentRow(Checksummed, Base):
    """An instrument, with its calibration, that a run used, and what it said of itself then."""

    __tablename__ = "run_instruments"

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    calibration_id: Mapped[int] = mapped_column(ForeignKey("calibrations.id"), primary_key=True)
    details: Mapped[dict[str, Any] | None]


class ChannelRow(Recorded, Checksummed, Base):
    """Settings of one input during a run."""

    __tablename__ = "channels"
    __table_args__ = (UniqueConstraint("run_id", "name"),)

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"))
    name: Mapped[str]
    physical: Mapped[str]
    kind: Mapped[str]
    unit: Mapped[str]
    sensitivity: Mapped[float]
    minimum: Mapped[float]
    maximum: Mapped[float]
    excitation_current: Mapped[float | None]
    polarity: Mapped[int | None]
    calibration_id: Mapped[int] = mapped_column(ForeignKey("calibrations.id"))
    calibration: Mapped[CalibrationRow] = relationship()


class PointRow(Recorded, Checksummed, Base):
    """A point struck in a hammer run; a set is one complete series along the beam."""

    __tablename__ = "points"
    __table_args__ = (UniqueConstraint("run_id", "set_number", "node", "direction"),)

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"))
    set_number: Mapped[int]
    node: Mapped[int]
    direction: Mapped[str]
    run: Mapped[RunRow] = relationship()


class BlowRow(Recorded, Checksummed, Base):
    """One blow, accepted or refused with its reason; force in N, its waveform in the run's file."""

    __tablename__ = "blows"
    __table_args__ = (UniqueConstraint("point_id", "number"),)

    point_id: Mapped[int] = mapped_column(ForeignKey("points.id"))
    number: Mapped[int]
    accepted: Mapped[bool]
    reason: Mapped[str | None]
    peak_force: Mapped[float | None]
    temperature_c: Mapped[float | None]
    struck_at: Mapped[datetime | None]
    waveform_record: Mapped[int | None]
    source: Mapped[str | None]
    point: Mapped[PointRow] = relationship()


class BlowWithdrawalRow(Recorded, Checksummed, Base):
    """An accepted blow was withdrawn: its row stays, and it no longer counts."""

    __tablename__ = "blow_withdrawals"

    blow_id: Mapped[int] = mapped_column(ForeignKey("blows.id"), unique=True)
    reason: Mapped[str]
    who: Mapped[str]


class SineRecordRow(Recorded, Checksummed, Base):
    """One steady-state sine record of the tester: displacement and force, peak-to-peak amplitudes in mm, Hz."""

    __tablename__ = "sine_records"
    __table_args__ = (UniqueConstraint("run_id", "order_number"), Index(None, "specimen_id"))

    id: Mapped[int] = mapped_column(WIDE, primary_key=True, sort_order=-1)
    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"))
    specimen_id: Mapped[int] = mapped_column(ForeignKey("specimens.id"))
    order_number: Mapped[int]
    configuration: Mapped[str]
    commanded_pp_mm: Mapped[float]
    reached_pp_mm: Mapped[float | None]
    frequency: Mapped[float]
    driven_frequency: Mapped[float | None]
    elapsed: Mapped[float]
    recorded_at: Mapped[datetime | None]
    temperature_c: Mapped[float | None]
    waveform_record: Mapped[int | None]
    run: Mapped[RunRow] = relationship()
    specimen: Mapped[SpecimenRow] = relationship()
