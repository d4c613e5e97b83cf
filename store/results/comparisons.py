"""Comparisons of the two experiments, element by element."""

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.database.columns import finite
from store.errors import NotFoundError
from store.models.results import ComparisonRow
from store.models.rows import from_row, to_columns
from store.results.analyses import article_of


@dataclass(frozen=True)
class Comparison:
    """One element of a joint by both experiments.

    Attributes:
        joint: its name, or the names of all joints whose sum is compared, such as I+II.
        element: k11, k22, k12, gamma11, gamma22 or gamma12.
        inverse, direct: 95 % intervals, low and high, in the element's unit; inverse is None where that experiment
            does not determine the element.
        verdict: agree, differ, not comparable.
        reason: why, in a sentence.
        frequency: Hz, and amplitude_pp_mm, mm: the direct point of the comparison, or None.
    """

    joint: str
    element: str
    inverse: tuple[float, float] | None
    direct: tuple[float, float]
    verdict: str
    reason: str | None = None
    frequency: float | None = None
    amplitude_pp_mm: float | None = None


def add_comparisons(session: Session, analysis_id: int, comparisons: Sequence[Comparison]) -> None:
    """Store the comparisons of an analysis of both experiments; StoreError if an interval is not finite."""
    article = article_of(session, analysis_id)
    for comparison in comparisons:
        where = f"comparison of {comparison.element}, joint {comparison.joint}"
        columns = to_columns(comparison, ComparisonRow)
        for name, interval in (("inverse", comparison.inverse), ("direct", comparison.direct)):
            if interval is not None:
                low, high = (finite(value, f"{where}: {name}") for value in interval)
                columns |= {f"{name}_low": low, f"{name}_high": high}
        session.add(ComparisonRow(analysis_id=analysis_id, article=article, **columns))
    session.flush()


def list_comparisons(session: Session, analysis_id: int) -> list[Comparison]:
    """The comparisons of an analysis in the order of storing, or NotFoundError."""
    query = select(ComparisonRow).filter_by(analysis_id=analysis_id).order_by(ComparisonRow.id)
    rows = session.scalars(query).all()
    if not rows:
        raise NotFoundError(f"analysis {analysis_id} has no comparisons")
    return [comparison_of(row) for row in rows]


def comparison_of(row: ComparisonRow) -> Comparison:
    """The comparison in a row."""
    low, high = row.inverse_low, row.inverse_high
    inverse = None if low is None or high is None else (low, high)
    return from_row(Comparison, row, inverse=inverse, direct=(row.direct_low, row.direct_high))
