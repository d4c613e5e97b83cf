"""The history of a specimen in the tester: one nominal point over all its runs, from the view v_dynamic_stiffness."""

from dataclasses import dataclass
from datetime import datetime
from typing import Any, NamedTuple

from sqlalchemy import ColumnClause, ColumnElement, String, column, func, select, table
from sqlalchemy.orm import Session

from store.models.base import Number, UtcDateTime, Whole
from store.models.measurements import SineRecordRow, SpecimenRow

MOST_POINTS = 2000


class NominalPoint(NamedTuple):
    """The nominal values of a sine point: configuration, mm peak to peak, Hz."""

    configuration: str
    amplitude_pp_mm: float
    frequency: float


@dataclass(frozen=True)
class HistoryPoint:
    """One run of the history; k in N/m, 95 % intervals, None where they are not known."""

    run_id: int
    measured_at: datetime
    temperature_c: float | None
    stiffness: float
    stiffness_low: float | None
    stiffness_high: float | None
    loss_factor: float
    loss_factor_low: float | None
    loss_factor_high: float | None


_COLUMNS: list[ColumnClause[Any]] = [
    column("run_id", Whole()),
    column("measured_at", UtcDateTime()),
    *(column(name, Number()) for name in list(HistoryPoint.__dataclass_fields__)[2:]),
]
_VIEW = table(
    "v_dynamic_stiffness",
    *_COLUMNS,
    column("latest"),
    column("article", String()),
    column("specimen", String()),
    column("configuration", String()),
    column("amplitude_pp_mm", Number()),
    column("frequency", Number()),
)


def nominal_points(session: Session, article: str, specimen: str) -> list[NominalPoint]:
    """The points at which a specimen was measured, those of most runs first."""
    asked = [_VIEW.c[name] for name in NominalPoint._fields]
    query = select(*asked).where(*_of(article, specimen)).group_by(*asked)
    query = query.order_by(func.count(_VIEW.c.run_id.distinct()).desc(), asked[0], asked[1].desc(), asked[2])
    return [NominalPoint(*row) for row in session.execute(query)]


def specimen_history(session: Session, article: str, specimen: str, point: NominalPoint) -> list[HistoryPoint]:
    """The newest result of each run at a nominal point, in the order of measuring; at most the last 2,000 runs."""
    query = select(*_COLUMNS).where(*_of(article, specimen))
    query = query.where(*(_VIEW.c[name] == value for name, value in point._asdict().items()))
    rows = session.execute(query.order_by(_VIEW.c.run_id.desc()).limit(MOST_POINTS))
    return sorted((HistoryPoint(*row) for row in rows), key=lambda each: (each.measured_at, each.run_id))


def runs_of_specimen(session: Session, article: str, specimen: str) -> list[int]:
    """Numbers of the runs with sine points of a specimen, the first one first."""
    query = select(_VIEW.c.run_id).distinct().where(*_of(article, specimen)).order_by(_VIEW.c.run_id)
    return [int(run) for run in session.scalars(query)]


def unidentified_runs(session: Session, article: str, specimen: str) -> list[int]:
    """Numbers of the runs with sine records of a specimen that have no sine points of it, the first one first."""
    of_specimen = select(SpecimenRow.id).filter_by(article=article, name=specimen)
    recorded = select(SineRecordRow.run_id).distinct().where(SineRecordRow.specimen_id.in_(of_specimen))
    known = set(runs_of_specimen(session, article, specimen))
    return sorted(int(run) for run in session.scalars(recorded) if run not in known)


def _of(article: str, specimen: str) -> tuple[ColumnElement[Any], ...]:
    return _VIEW.c.latest, _VIEW.c.article == article, _VIEW.c.specimen == specimen
