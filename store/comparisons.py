"""Comparisons of the two experiments, element by element."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.analyses import article_of
from store.columns import finite
from store.errors import NotFoundError
from store.models.results import ComparisonRow


@dataclass(frozen=True)
class Comparison:
    """One element of a joint by both experiments.

    Attributes:
        joint: its name, or the names of all joints whose sum is compared, such as I+II.
        element: k22, h11, gamma22, ...
        inverse, direct: 95 % intervals, low and high, in the element's unit; inverse is None where that experiment
            does not determine the element.
        verdict: agree, differ, not comparable.
        reason: the verdict's, in a sentence.
        frequency: Hz, and amplitude_pp_mm, mm: at which of the direct points it was made, or None.
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
    """Store the comparisons of an analysis, whose runs are those of both experiments.

    Raises:
        StoreError: an interval is not finite.
    """
    article = article_of(session, analysis_id)
    for comparison in comparisons:
        where = f"comparison of {comparison.element}, joint {comparison.joint}"
        low, high = (
            (None, None)
            if comparison.inverse is None
            else (finite(value, f"{where}: inverse") for value in comparison.inverse)
        )
        direct_low, direct_high = (finite(value, f"{where}: direct") for value in comparison.direct)
        session.add(
            ComparisonRow(
                analysis_id=analysis_id,
                article=article,
                joint=comparison.joint,
                element=comparison.element,
                frequency=comparison.frequency,
                amplitude_pp_mm=comparison.amplitude_pp_mm,
                inverse_low=low,
                inverse_high=high,
                direct_low=direct_low,
                direct_high=direct_high,
                verdict=comparison.verdict,
                reason=comparison.reason,
            )
        )
    session.flush()


def list_comparisons(session: Session, analysis_id: int) -> list[Comparison]:
    """The comparisons of an analysis, in the order of storing.

    Raises:
        NotFoundError: it has none.
    """
    rows = session.scalars(select(ComparisonRow).filter_by(analysis_id=analysis_id).order_by(ComparisonRow.id)).all()
    if not rows:
        raise NotFoundError(f"analysis {analysis_id} has no comparisons")
    return [
        Comparison(
            joint=row.joint,
            element=row.element,
            inverse=(
                None if row.inverse_low is None or row.inverse_high is None else (row.inverse_low, row.inverse_high)
            ),
            direct=(row.direct_low, row.direct_high),
            verdict=row.verdict,
            reason=row.reason,
            frequency=row.frequency,
            amplitude_pp_mm=row.amplitude_pp_mm,
        )
        for row in rows
    ]
