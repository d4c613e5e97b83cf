"""Points struck in a hammer run, and every blow on them, accepted or refused."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from store.dof import StoredDof
from store.errors import NotFoundError, StoreError
from store.models.measurements import BlowRow, BlowWithdrawalRow, PointRow, RunRow
from store.waveform import WaveformReference


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
        struck_at: UTC of the trigger, or None where an imported file does not say.
        waveform: where the record is, or None where nothing was recorded.
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
    """Begin a point.

    Raises:
        NotFoundError: there is no such run.
        StoreError: the set has this point already.
    """
    _waveform_file(session, run_id)
    same = {"run_id": run_id, "set_number": set_number, "node": dof.node, "direction": dof.direction}
    if session.scalars(select(PointRow.id).filter_by(**same)).first() is not None:
        raise StoreError(f"run {run_id}, set {set_number} has point {dof} already")
    row = PointRow(**same)
    session.add(row)
    session.flush()
    return Point(row.id, run_id, dof, set_number)


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

    Raises:
        StoreError: a refused blow has no reason or an accepted one has, or the waveform is of another run.
    """
    if accepted == bool(reason):
        said = f"with the reason {reason!r}" if reason else "without a reason"
        raise StoreError(f"blow {number} at {point.dof} is {'accepted' if accepted else 'refused'} {said}")
    if waveform is not None and waveform.file != _waveform_file(session, point.run_id):
        raise StoreError(f"blow {number} at {point.dof}: waveform {waveform} is not of run {point.run_id}")
    row = BlowRow(
        point_id=point.id,
        number=number,
        accepted=accepted,
        reason=reason,
        peak_force=peak_force,
        temperature_c=temperature_c,
        struck_at=struck_at,
        waveform_record=None if waveform is None else waveform.record,
        source=source,
    )
    session.add(row)
    session.flush()
    return Blow(
        point.dof,
        point.set_number,
        number,
        accepted,
        reason,
        peak_force,
        temperature_c,
        struck_at,
        waveform,
        source,
        row.id,
        point.run_id,
    )


def list_blows(session: Session, run_id: int) -> list[Blow]:
    """Every blow of a run, in the order of storing.

    Raises:
        NotFoundError: there is no such run.
    """
    file = _waveform_file(session, run_id)
    taken_back = BlowWithdrawalRow
    rows = session.execute(
        select(BlowRow, PointRow, taken_back.reason)
        .join(PointRow, PointRow.id == BlowRow.point_id)
        .outerjoin(taken_back, taken_back.blow_id == BlowRow.id)
        .where(PointRow.run_id == run_id)
        .order_by(BlowRow.id)
    )
    return [_blow(blow, point, file, withdrawn) for blow, point, withdrawn in rows]


def get_blow(session: Session, blow_id: int) -> Blow:
    """One blow.

    Raises:
        NotFoundError: there is no such blow.
    """
    row = session.get(BlowRow, blow_id)
    if row is None:
        raise NotFoundError(f"there is no blow {blow_id}")
    withdrawn = session.scalars(select(BlowWithdrawalRow.reason).filter_by(blow_id=blow_id)).one_or_none()
    return _blow(row, row.point, row.point.run.waveform_file, withdrawn)


def withdraw_blow(session: Session, blow_id: int, reason: str, who: str) -> Blow:
    """Take an accepted blow back: its record stays, and it counts no more.

    Raises:
        NotFoundError: there is no such blow.
        StoreError: it does not count already.
    """
    blow = get_blow(session, blow_id)
    if not blow.accepted:
        raise StoreError(f"blow {blow_id} does not count already: {blow.reason}")
    session.add(BlowWithdrawalRow(blow_id=blow_id, reason=reason, who=who))
    session.flush()
    return get_blow(session, blow_id)


def count_withdrawals(session: Session, point_id: int) -> int:
    """How many accepted blows of a point were taken back."""
    query = select(func.count()).select_from(BlowWithdrawalRow)
    query = query.join(BlowRow, BlowRow.id == BlowWithdrawalRow.blow_id)
    return session.scalar(query.where(BlowRow.point_id == point_id)) or 0


def _blow(row: BlowRow, point: PointRow, file: str, withdrawn: str | None) -> Blow:
    return Blow(
        point=StoredDof(point.node, point.direction),
        set_number=point.set_number,
        number=row.number,
        accepted=row.accepted and withdrawn is None,
        reason=row.reason or (None if withdrawn is None else f"withdrawn: {withdrawn}"),
        peak_force=row.peak_force,
        temperature_c=row.temperature_c,
        struck_at=row.struck_at,
        waveform=None if row.waveform_record is None else WaveformReference(file, row.waveform_record),
        source=row.source,
        id=row.id,
        run_id=point.run_id,
    )


def _waveform_file(session: Session, run_id: int) -> str:
    file = session.scalars(select(RunRow.waveform_file).filter_by(id=run_id)).one_or_none()
    if file is None:
        raise NotFoundError(f"there is no run {run_id}")
    return file
