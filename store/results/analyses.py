"""Analyses: one row for each computation, to which its results point; it points to its runs and parents."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from store.errors import LeftOutError, NotFoundError, StoreError
from store.models.measurements import RunRow
from store.models.results import AnalysisParentRow, AnalysisRow, AnalysisRunRow
from store.models.rows import add_row, from_row, get_row
from store.provenance import configuration_hash

NO_RESULT = "no_result"
"""Key of an analysis' settings: why it has no results, a phrase. Older ones of its method are not the newest then."""


@dataclass(frozen=True)
class Analysis:
    """One computation: its kind (an `AnalysisKind` or another word), method, settings, and what it was made from."""

    id: int
    kind: str
    method: str
    settings: dict[str, Any]
    runs: tuple[int, ...]
    parents: tuple[int, ...]
    configuration_hash: str
    software_version: str
    created_at: datetime


def add_analysis(
    session: Session,
    *,
    kind: str,
    method: str,
    settings: dict[str, Any],
    runs: Sequence[int],
    parents: Sequence[int] = (),
) -> int:
    """Store a computation from `runs` and the results of `parents`; return its number.

    Raises StoreError if there are no runs, or the settings have no JSON form.
    """
    if not runs:
        raise StoreError(f"analysis {kind!r} names no run that it was made from")
    configuration = {"kind": kind, "method": method, "settings": settings}
    row = AnalysisRow(kind=kind, method=method, settings=settings, configuration_hash=configuration_hash(configuration))
    add_row(session, row)
    session.add_all(AnalysisRunRow(analysis_id=row.id, run_id=run) for run in sorted(set(runs)))
    session.add_all(AnalysisParentRow(analysis_id=row.id, parent_id=parent) for parent in sorted(set(parents)))
    session.flush()
    return row.id


def get_analysis(session: Session, analysis_id: int) -> Analysis:
    """One analysis, or NotFoundError."""
    row = get_row(session, AnalysisRow, analysis_id, "analysis")
    runs = select(AnalysisRunRow.run_id).filter_by(analysis_id=analysis_id)
    parents = select(AnalysisParentRow.parent_id).filter_by(analysis_id=analysis_id)
    return from_row(
        Analysis,
        row,
        runs=tuple(session.scalars(runs.order_by(AnalysisRunRow.run_id))),
        parents=tuple(session.scalars(parents.order_by(AnalysisParentRow.parent_id))),
    )


def list_analyses(session: Session, run_id: int, kind: str | None = None) -> list[Analysis]:
    """The analyses of a run, newest first, optionally of one kind."""
    return [get_analysis(session, number) for number in session.scalars(_newest_first(run_id, kind))]


def article_of(session: Session, analysis_id: int) -> str:
    """The test article of an analysis; StoreError if its runs are not of exactly one article."""
    articles = set(
        session.scalars(
            select(RunRow.article)
            .join(AnalysisRunRow, AnalysisRunRow.run_id == RunRow.id)
            .where(AnalysisRunRow.analysis_id == analysis_id)
        )
    )
    if len(articles) != 1:
        raise StoreError(f"analysis {analysis_id} is about {len(articles)} test articles, expected one")
    return articles.pop()


def latest_analysis(session: Session, run_id: int, kind: str) -> Analysis:
    """The newest analysis of a kind that used a run, or NotFoundError."""
    newest = session.scalars(_newest_first(run_id, kind).limit(1)).one_or_none()
    if newest is None:
        raise NotFoundError(f"run {run_id} has no {_words(kind)}; identify or diagnose it first, if that was measured")
    return get_analysis(session, newest)


def without_result(session: Session, analysis_id: int, kind: str) -> NotFoundError:
    """The error to raise where an analysis has no row of results: `LeftOutError` where it was stored without any."""
    row, what = session.get(AnalysisRow, analysis_id), f"analysis {analysis_id} has no {_words(kind)}"
    reason = None if row is None else row.settings.get(NO_RESULT)
    return NotFoundError(what) if reason is None else LeftOutError(what, str(reason))


def chosen_analysis(session: Session, run_id: int, kind: str, analysis_id: int | None) -> Analysis:
    """The analysis of a run with this number, or the newest of its kind without a number; NotFoundError if none."""
    if analysis_id is None:
        return latest_analysis(session, run_id, kind)
    query = _newest_first(run_id, kind).where(AnalysisRow.id == analysis_id)
    if session.scalars(query).one_or_none() is None:
        raise NotFoundError(f"run {run_id} has no analysis {analysis_id} with {_words(kind)}; see its list of analyses")
    return get_analysis(session, analysis_id)


def _words(kind: str) -> str:
    return str(kind).replace("_", " ")


def _newest_first(run_id: int, kind: str | None) -> Select[int]:
    query = select(AnalysisRow.id).join(AnalysisRunRow, AnalysisRunRow.analysis_id == AnalysisRow.id)
    query = query.where(AnalysisRunRow.run_id == run_id).order_by(AnalysisRow.id.desc())
    return query if kind is None else query.where(AnalysisRow.kind == kind)
