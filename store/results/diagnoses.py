"""Diagnoses of the gap between measurement and simulation."""

from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session, aliased, defer

from store.errors import NotFoundError
from store.models.results import AnalysisRunRow
from store.models.rows import add_row, from_row, newest_first, to_columns
from store.models.service import DiagnosisRow


@dataclass(frozen=True)
class StoredVerdict:
    """The result of a diagnosis in short.

    Attributes:
        analysis_id: its analysis, which names the run.
        status: none, explained, partial or unknown.
        effects: names of the effects that explain the gap.
        gap_before_percent, gap_after_percent: on data that no fit used; None where they were not determined.
        created_at: UTC; None before it is stored.
    """

    analysis_id: int
    status: str
    effects: tuple[str, ...]
    gap_before_percent: float | None
    gap_after_percent: float | None
    created_at: datetime | None = None


@dataclass(frozen=True)
class StoredDiagnosis(StoredVerdict):
    """The result of a diagnosis, with its whole `document` of some hundred kilobytes."""

    document: dict[str, Any] = field(kw_only=True)


def add_diagnosis(session: Session, found: StoredDiagnosis) -> None:
    """Store a diagnosis; StoreError if its document has no JSON form or the analysis has a diagnosis already."""
    columns = to_columns(found, DiagnosisRow) | {"effects": list(found.effects)}
    del columns["created_at"]  # the row has the time of storing
    add_row(session, DiagnosisRow(**columns))


def get_diagnosis(session: Session, analysis_id: int) -> StoredDiagnosis:
    """The diagnosis of an analysis, or NotFoundError."""
    row = session.scalars(select(DiagnosisRow).filter_by(analysis_id=analysis_id)).one_or_none()
    if row is None:
        raise NotFoundError(f"there is no diagnosis {analysis_id}")
    return from_row(StoredDiagnosis, row, effects=tuple(row.effects))


def list_diagnoses(
    session: Session,
    *,
    run_id: int | None = None,
    alone: bool = False,
    before: int | None = None,
    limit: int = 100,
) -> list[StoredVerdict]:
    """Verdicts, newest first.

    Args:
        run_id: only of this run.
        alone: only of this run by itself, not together with others.
        before: a page begins before this analysis.
        limit: the most that are listed.
    """
    query = select(DiagnosisRow).options(defer(DiagnosisRow.document, raiseload=True))
    if run_id is not None:
        query = query.join(AnalysisRunRow, AnalysisRunRow.analysis_id == DiagnosisRow.analysis_id)
        query = query.where(AnalysisRunRow.run_id == run_id)
        if alone:
            other = aliased(AnalysisRunRow)
            others = select(other).where(other.analysis_id == DiagnosisRow.analysis_id, other.run_id != run_id)
            query = query.where(~others.correlate(DiagnosisRow).exists())
    rows = session.scalars(newest_first(query, DiagnosisRow.analysis_id, before, limit))
    return [from_row(StoredVerdict, row, effects=tuple(row.effects)) for row in rows]
