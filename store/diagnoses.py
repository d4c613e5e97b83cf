"""Diagnoses of the gap between measurement and simulation."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.errors import NotFoundError
from store.models.results import AnalysisRunRow
from store.models.service import DiagnosisRow


@dataclass(frozen=True)
class StoredVerdict:
    """What a diagnosis found, in short.

    Attributes:
        analysis_id: its analysis, which names the run.
        status: none, explained, partial or unknown.
        effects: that explain the gap, by their names.
        gap_before_percent, gap_after_percent: on data that no fit saw; None where it was not determined.
    """

    analysis_id: int
    status: str
    effects: tuple[str, ...]
    gap_before_percent: float | None
    gap_after_percent: float | None
    created_at: datetime | None = None


@dataclass(frozen=True)
class StoredDiagnosis(StoredVerdict):
    """What a diagnosis found, with all of it in a `document` of some hundred kilobytes."""

    document: dict[str, Any] = field(kw_only=True)


def add_diagnosis(session: Session, found: StoredDiagnosis) -> None:
    """Keep what a diagnosis found.

    Raises:
        StoreError: the document has no JSON form, or the analysis has a diagnosis already.
    """
    session.add(
        DiagnosisRow(
            analysis_id=found.analysis_id,
            status=found.status,
            effects=list(found.effects),
            gap_before_percent=found.gap_before_percent,
            gap_after_percent=found.gap_after_percent,
            document=found.document,
        )
    )
    session.flush()


def get_diagnosis(session: Session, analysis_id: int) -> StoredDiagnosis:
    """The diagnosis of an analysis.

    Raises:
        NotFoundError: it has none.
    """
    row = session.scalars(select(DiagnosisRow).filter_by(analysis_id=analysis_id)).one_or_none()
    if row is None:
        raise NotFoundError(f"there is no diagnosis {analysis_id}")
    return StoredDiagnosis(
        analysis_id=row.analysis_id,
        status=row.status,
        effects=tuple(row.effects),
        gap_before_percent=row.gap_before_percent,
        gap_after_percent=row.gap_after_percent,
        created_at=row.created_at,
        document=row.document,
    )


def list_diagnoses(
    session: Session,
    *,
    run_id: int | None = None,
    before: int | None = None,
    limit: int = 100,
) -> list[StoredVerdict]:
    """Verdicts, newest first; `before` the number of an analysis, to go on with a list."""
    table = DiagnosisRow
    query = select(
        table.analysis_id,
        table.status,
        table.effects,
        table.gap_before_percent,
        table.gap_after_percent,
        table.created_at,
    )
    if run_id is not None:
        query = query.join(
            AnalysisRunRow, AnalysisRunRow.analysis_id == table.analysis_id
        ).where(AnalysisRunRow.run_id == run_id)  # fmt: skip
    if before is not None:
        query = query.where(table.analysis_id < before)
    rows = session.execute(query.order_by(table.analysis_id.desc()).limit(limit))
    return [
        StoredVerdict(analysis, status, tuple(effects), before_percent, after_percent, made)
        for analysis, status, effects, before_percent, after_percent, made in rows
    ]
