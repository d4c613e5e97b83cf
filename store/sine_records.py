"""Steady-state sine records of the elastomer tester."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.errors import NotFoundError, StoreError
from store.models.measurements import RunRow, SineRecordRow, SpecimenRow
from store.runs import specimen_id
from store.waveform import WaveformReference

CONFIGURATIONS = ("compression", "shear", "angled")
BLANK = "blank"
"""Configuration of a known piece in place of a specimen, by which the tester is calibrated."""


@dataclass(frozen=True)
class SineRecord:
    """One record of displacement and force at one commanded sine.

    Attributes:
        order_number: the order of measuring within the run, from 1; a point that is taken again gets a new one.
        specimen: the joint (I or II) whose cylinders are tested, or the name of a known piece.
        configuration: compression, shear or angled; blank for a known piece.
        commanded_pp_mm: commanded peak-to-peak amplitude, mm.
        reached_pp_mm: reached peak-to-peak amplitude, mm.
        frequency: Hz.
        elapsed: s since the start of the run.
        recorded_at: UTC, or None where it is not known.
        waveform: where the record is, or None where only the result is known.
        id: number of the stored row; None before it is stored.
    """

    order_number: int
    specimen: str
    configuration: str
    commanded_pp_mm: float
    reached_pp_mm: float | None
    frequency: float
    elapsed: float
    recorded_at: datetime | None
    temperature_c: float | None
    waveform: WaveformReference | None
    id: int | None = None


def add_sine_record(session: Session, run_id: int, record: SineRecord) -> int:
    """Store a sine record and return its number; its waveform is appended to the run's file first.

    Raises:
        NotFoundError: there is no such run.
        StoreError: the configuration is unknown, or the waveform is of another run.
    """
    article, waveform_file = _run(session, run_id)
    known = (*CONFIGURATIONS, BLANK)
    if record.configuration not in known:
        raise StoreError(f"configuration {record.configuration!r} is none of {', '.join(known)}")
    if record.waveform is not None and record.waveform.file != waveform_file:
        raise StoreError(f"sine record {record.order_number}: waveform {record.waveform} is not of run {run_id}")
    row = SineRecordRow(
        run_id=run_id,
        specimen_id=specimen_id(session, article, record.specimen),
        order_number=record.order_number,
        configuration=record.configuration,
        commanded_pp_mm=record.commanded_pp_mm,
        reached_pp_mm=record.reached_pp_mm,
        frequency=record.frequency,
        elapsed=record.elapsed,
        recorded_at=record.recorded_at,
        temperature_c=record.temperature_c,
        waveform_record=None if record.waveform is None else record.waveform.record,
    )
    session.add(row)
    session.flush()
    return row.id


def list_sine_records(session: Session, run_id: int) -> list[SineRecord]:
    """The sine records of a run in the order of measuring.

    Raises:
        NotFoundError: there is no such run.
    """
    _, file = _run(session, run_id)
    rows = session.execute(
        select(SineRecordRow, SpecimenRow.name)
        .join(SpecimenRow, SpecimenRow.id == SineRecordRow.specimen_id)
        .where(SineRecordRow.run_id == run_id)
        .order_by(SineRecordRow.order_number)
    )
    return [_record(row, specimen, file) for row, specimen in rows]


def get_sine_record(session: Session, record_id: int) -> SineRecord:
    """One sine record.

    Raises:
        NotFoundError: there is no such record.
    """
    row = session.get(SineRecordRow, record_id)
    if row is None:
        raise NotFoundError(f"there is no sine record {record_id}")
    return _record(row, row.specimen.name, row.run.waveform_file)


def _record(row: SineRecordRow, specimen: str, file: str) -> SineRecord:
    return SineRecord(
        order_number=row.order_number,
        specimen=specimen,
        configuration=row.configuration,
        commanded_pp_mm=row.commanded_pp_mm,
        reached_pp_mm=row.reached_pp_mm,
        frequency=row.frequency,
        elapsed=row.elapsed,
        recorded_at=row.recorded_at,
        temperature_c=row.temperature_c,
        waveform=None if row.waveform_record is None else WaveformReference(file, row.waveform_record),
        id=row.id,
    )


def _run(session: Session, run_id: int) -> tuple[str, str]:
    """Article and waveform file, without the run's setup: a sweep asks for them with every record."""
    row = session.execute(select(RunRow.article, RunRow.waveform_file).filter_by(id=run_id)).one_or_none()
    if row is None:
        raise NotFoundError(f"there is no run {run_id}")
    return row.article, row.waveform_file
