"""Steady-state sine records of the elastomer tester."""

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import select
from sqlalchemy.orm import Session, joinedload

from store.errors import StoreError
from store.measurements.runs import run_in_short
from store.measurements.specimens import specimen_id
from store.models.measurements import SineRecordRow
from store.models.rows import add_row, from_row, get_row, to_columns
from store.states import BLANK, CONFIGURATIONS
from store.waveforms.waveform import WaveformReference, record_number, reference_to


@dataclass(frozen=True)
class SineRecord:
    """One record of displacement and force at one commanded sine.

    Attributes:
        order_number: the order of measuring within the run, from 1; a repeated point gets a new one.
        specimen: the joint (I or II) whose cylinders are tested, or the name of a known piece.
        configuration: compression, shear or angled; blank for a known piece.
        commanded_pp_mm: commanded peak-to-peak amplitude, mm.
        reached_pp_mm: reached peak-to-peak amplitude, mm.
        frequency: Hz, as planned.
        elapsed: s since the start of the run.
        recorded_at: UTC, or None where it is not known.
        driven_frequency: Hz, at which the actuator moved, where that was beside a multiple of the mains; else None.
        waveform: reference to the record, or None where only the result is known.
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
    driven_frequency: float | None = None

    @property
    def true_frequency(self) -> float:
        """Frequency of the record, Hz."""
        return self.frequency if self.driven_frequency is None else self.driven_frequency


def add_sine_record(session: Session, run_id: int, record: SineRecord) -> int:
    """Store a sine record and return its number; its waveform is appended to the run's file first.

    Raises NotFoundError if there is no such run; StoreError if the configuration is unknown, or the waveform is of
    another run.
    """
    run = run_in_short(session, run_id)
    known = (*CONFIGURATIONS, BLANK)
    if record.configuration not in known:
        raise StoreError(f"configuration {record.configuration!r} is none of {', '.join(known)}")
    row = SineRecordRow(
        run_id=run_id,
        specimen_id=specimen_id(session, run.article, record.specimen),
        waveform_record=record_number(record.waveform, run.waveform_file, f"sine record {record.order_number}"),
        **to_columns(record, SineRecordRow),
    )
    return add_row(session, row).id


def list_sine_records(session: Session, run_id: int) -> list[SineRecord]:
    """The sine records of a run in the order of measuring; NotFoundError where there is no such run."""
    file = run_in_short(session, run_id).waveform_file
    query = select(SineRecordRow).options(joinedload(SineRecordRow.specimen)).filter_by(run_id=run_id)
    return [_record(row, file) for row in session.scalars(query.order_by(SineRecordRow.order_number))]


def get_sine_record(session: Session, record_id: int) -> SineRecord:
    """One sine record, or NotFoundError."""
    row = get_row(session, SineRecordRow, record_id, "sine record")
    return _record(row, row.run.waveform_file)


def _record(row: SineRecordRow, file: str) -> SineRecord:
    return from_row(SineRecord, row, specimen=row.specimen.name, waveform=reference_to(file, row.waveform_record))
