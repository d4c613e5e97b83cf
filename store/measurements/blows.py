"""Points of a hammer run and their blows, accepted or refused."""

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import select
from sqlalchemy.orm import Session, contains_eager

from store.dof import StoredDof
from store.errors import StoreError
from store.measurements.runs import run_in_short
from store.models.measurements import BlowRow, BlowWithdrawalRow, PointRow
from store.models.rows import add_row, from_row, get_row
from store.waveforms.waveform import WaveformReference, record_number, reference_to


@dataclass(frozen=True)
class Point:
    """A point of a roving-hammer set; sets are numbered from 1 within the run."""

    id: int
    run_id: int
    dof: StoredDof
    set_number: int


@dataclass(frozen=True)
class Blow:
    """One blow.

    Attributes:
        number: counts the blows on the point, refused ones too, from 1.
        reason: why it was refused, or withdrawn later; None where it counts.
        peak_force: N, or None where nothing was recorded.
        struck_at: UTC of the trigger, or None where an imported file does not state it.
        waveform: reference to the record, or None where nothing was recorded.
        source: the file it was imported from, or None for a blow recorded here.
        id: number of the stored row; run_id: the run that it belongs to.
    """

    point: StoredDof
    set_number: int
    number: int
    accepted: bool
    reason: str | None
    peak_force: float | None
    temperature_c: float | None
    struck_at: datetime | None
    waveform: WaveformReference | None
    source: str | None = None
    id: int | None = None
    run_id: int | None = None


def add_point(session: Session, run_id: int, dof: StoredDof, set_number: int = 1) -> Point:
    """Begin a point; NotFoundError if there is no such run, StoreError if the set has this point already."""
    run_in_short(session, run_id)
    same = {"run_id": run_id, "set_number": set_number, "node": dof.node, "direction": dof.direction}
    if session.scalars(select(PointRow.id).filter_by(**same)).first() is not None:
        raise StoreError(f"run {run_id}, set {set_number} has point {dof} already")
    return Point(add_row(session, PointRow(**same)).id, run_id, dof, set_number)


def list_points(session: Session, run_id: int) -> list[Point]:
    """The points of a run in the order in which they were begun."""
    rows = session.scalars(select(PointRow).filter_by(run_id=run_id).order_by(PointRow.id))
    return [Point(row.id, run_id, StoredDof(row.node, row.direction), row.set_number) for row in rows]


def add_blow(
    session: Session,
    point: Point,
    number: int,
    *,
    accepted: bool,
    reason: str | None = None,
    waveform: WaveformReference | None = None,
    peak_force: float | None = None,
    temperature_c: float | None = None,
    struck_at: datetime | None = None,
    source: str | None = None,
) -> Blow:
    """Store a blow; its waveform is appended to the run's file first (`Catalogue.waveforms`).

    Raises StoreError if a refused blow has no reason or an accepted one has, or the waveform is of another run.
    """
    if accepted == bool(reason):
        said = f"with the reason {reason!r}" if reason else "without a reason"
        raise StoreError(f"blow {number} at {point.dof} is {'accepted' if accepted else 'refused'} {said}")
    file = run_in_short(session, point.run_id).waveform_file
    row = BlowRow(
        point_id=point.id,
        number=number,
        accepted=accepted,
        reason=reason,
        peak_force=peak_force,
        temperature_c=temperature_c,
        struck_at=struck_at,
        waveform_record=record_number(waveform, file, f"blow {number} at {point.dof}"),
        source=source,
    )
    return _blow(add_row(session, row), file, None)


def list_blows(session: Session, run_id: int) -> list[Blow]:
    """Every blow of a run, in the order of storing; NotFoundError where there is no such run."""
    file = run_in_short(session, run_id).waveform_file
    rows = session.execute(
        select(BlowRow, BlowWithdrawalRow.reason)
        .join(PointRow, PointRow.id == BlowRow.point_id)
        .outerjoin(BlowWithdrawalRow, BlowWithdrawalRow.blow_id == BlowRow.id)
        .options(contains_eager(BlowRow.point))
        .where(PointRow.run_id == run_id)
        .order_by(BlowRow.id)
    )
    return [_blow(blow, file, withdrawn) for blow, withdrawn in rows]


def get_blow(session: Session, blow_id: int) -> Blow:
    """One blow, or NotFoundError."""
    row = get_row(session, BlowRow, blow_id, "blow")
    withdrawn = session.scalars(select(BlowWithdrawalRow.reason).filter_by(blow_id=blow_id)).one_or_none()
    return _blow(row, row.point.run.waveform_file, withdrawn)


def withdraw_blow(session: Session, blow_id: int, reason: str, who: str) -> Blow:
    """Withdraw an accepted blow: its record stays, and it no longer counts.

    Raises NotFoundError if there is no such blow, StoreError if it does not count already.
    """
    get_row(session, BlowRow, blow_id, "blow", for_update=True)  # somebody else may withdraw it in this moment
    blow = get_blow(session, blow_id)
    if not blow.accepted:
        raise StoreError(f"blow {blow_id} does not count already: {blow.reason}")
    add_row(session, BlowWithdrawalRow(blow_id=blow_id, reason=reason, who=who))
    return get_blow(session, blow_id)


def _blow(row: BlowRow, file: str, withdrawn: str | None) -> Blow:
    point = row.point
    return from_row(
        Blow,
        row,
        point=StoredDof(point.node, point.direction),
        set_number=point.set_number,
        accepted=row.accepted and withdrawn is None,
        reason=row.reason or (None if withdrawn is None else f"withdrawn: {withdrawn}"),
        waveform=reference_to(file, row.waveform_record),
        run_id=point.run_id,
    )
