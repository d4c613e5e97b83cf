"""Master curves of specimens: complex stiffness over reduced frequency, from sweeps at several temperatures."""

from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from store.errors import NotFoundError
from store.measurements.specimens import specimen_id
from store.models.measurements import SpecimenRow
from store.models.results import MasterCurveRow
from store.models.rows import add_row, equal, newest_first, to_columns
from store.results.analyses import article_of


@dataclass(frozen=True)
class StoredMasterSummary:
    """A master curve in short.

    Attributes:
        analysis_id: its analysis, which names the runs, and the sine points as its parents.
        article, specimen, configuration, amplitude_pp_mm: of all points.
        shift: law of the shift, wlf or arrhenius.
        reference_c: degrees Celsius.
        lowest_reduced_frequency, highest_reduced_frequency: that were measured, Hz.
        created_at: UTC; None before it is stored.
    """

    analysis_id: int
    article: str
    specimen: str
    configuration: str
    amplitude_pp_mm: float
    shift: str
    reference_c: float
    lowest_reduced_frequency: float
    highest_reduced_frequency: float
    created_at: datetime | None = None


@dataclass(frozen=True)
class StoredMasterCurve(StoredMasterSummary):
    """A master curve, with its whole `document` of some ten kilobytes and more."""

    document: dict[str, Any] = field(kw_only=True)


_SHORT = (
    MasterCurveRow.analysis_id,
    SpecimenRow.article,
    SpecimenRow.name.label("specimen"),
    MasterCurveRow.configuration,
    MasterCurveRow.amplitude_pp_mm,
    MasterCurveRow.shift,
    MasterCurveRow.reference_c,
    MasterCurveRow.lowest_reduced_frequency,
    MasterCurveRow.highest_reduced_frequency,
    MasterCurveRow.created_at,
)


def add_master_curve(session: Session, found: StoredMasterCurve) -> None:
    """Store a master curve.

    Raises:
        StoreError: its document has no JSON form, its analysis has a master curve already, or is not of its article.
    """
    columns = to_columns(found, MasterCurveRow)
    del columns["created_at"]  # the row has the time of storing
    article = article_of(session, found.analysis_id)
    add_row(session, MasterCurveRow(specimen_id=specimen_id(session, article, found.specimen), **columns))


def get_master_curve(session: Session, analysis_id: int) -> StoredMasterCurve:
    """The master curve of an analysis, or NotFoundError."""
    query = _joined(select(*_SHORT, MasterCurveRow.document)).where(MasterCurveRow.analysis_id == analysis_id)
    row = session.execute(query).one_or_none()
    if row is None:
        raise NotFoundError(f"there is no master curve {analysis_id}")
    return StoredMasterCurve(**row._mapping)


def list_master_curves(
    session: Session,
    *,
    article: str | None = None,
    specimen: str | None = None,
    before: int | None = None,
    limit: int = 100,
) -> list[StoredMasterSummary]:
    """Master curves in short, newest first.

    Args:
        article, specimen: only of these.
        before: a page begins before this analysis.
        limit: the most that are listed.
    """
    query = _joined(select(*_SHORT)).where(*equal(SpecimenRow, article=article, name=specimen))
    rows = session.execute(newest_first(query, MasterCurveRow.analysis_id, before, limit))
    return [StoredMasterSummary(**row._mapping) for row in rows]


def _joined(query: Select[*tuple[Any, ...]]) -> Select[*tuple[Any, ...]]:
    return query.join(SpecimenRow, SpecimenRow.id == MasterCurveRow.specimen_id)
