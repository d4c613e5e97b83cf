"""Comparisons of the two experiments, element by element."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from api.service.access import Reader
from api.service.context import Context
from api.service.documents import OfAnalysis, RunNumber, Words
from api.service.etags import TaggedRoute
from api.service.pages import Cursor, Limit, Page, number_from, page_of, page_of_whole
from api.service.problems import problems
from store.analyses import chosen_analysis
from store.comparisons import Comparison, list_comparisons
from store.quantity import quantity
from store.result_queries import find_comparisons
from store.states import AnalysisKind

router = APIRouter(tags=["comparisons"], route_class=TaggedRoute)
UNITS = "N/m, N, N m, or 1 for gamma"


class ComparisonDocument(BaseModel):
    """One element by both experiments; intervals are [low, high] and hold 95 %."""

    joint: str = Field(description="a joint, or all whose sum is compared, such as I+II")
    element: str = Field(description="k22, h11, gamma22, ...")
    inverse: Annotated[list[float] | None, quantity(UNITS, "null where that experiment does not determine it")]
    direct: Annotated[list[float], quantity(UNITS)]
    verdict: str
    reason: str | None
    frequency: Annotated[float | None, quantity("Hz")]
    amplitude_pp_mm: Annotated[float | None, quantity("mm", "peak to peak")]

    @classmethod
    def of(cls, found: Comparison) -> ComparisonDocument:
        """What is shown of a comparison."""
        return cls(**(vars(found) | {"inverse": found.inverse and list(found.inverse), "direct": list(found.direct)}))


class FoundComparison(ComparisonDocument):
    """A comparison, and where it stands."""

    id: int
    analysis_id: int
    run_id: int


@router.get("/runs/{run_id}/comparisons", responses=problems(401, 403, 404))
def of_run(
    _who: Reader,
    context: Context,
    run_id: RunNumber,
    analysis: OfAnalysis = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Page[ComparisonDocument]:
    """The comparison on a run, element by element: the newest or that of one analysis."""
    with context.catalogue.reading() as session:
        made = chosen_analysis(session, run_id, AnalysisKind.COMPARISONS, analysis)
        found = list_comparisons(session, made.id)
    return page_of_whole([ComparisonDocument.of(each) for each in found], limit, cursor)


@router.get("/comparisons", responses=problems(401, 403))
def of_article(
    _who: Reader,
    context: Context,
    article: Annotated[Words, Query(description="the test article")],
    joint: Annotated[Words | None, Query(description="only of this joint")] = None,
    verdict: Annotated[Words | None, Query(description="agree, differ, ...")] = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Page[FoundComparison]:
    """Every comparison that was ever made on an article, newest first."""
    with context.catalogue.reading() as session:
        found = find_comparisons(
            session, article=article, joint=joint, verdict=verdict, before=number_from(cursor), limit=limit + 1
        )
    items = [
        FoundComparison(
            **place._asdict(),
            joint=each.joint,
            element=each.element,
            inverse=_interval(each.inverse_low, each.inverse_high),
            direct=[each.direct_low, each.direct_high],
            verdict=each.verdict,
            reason=each.reason,
            frequency=each.frequency,
            amplitude_pp_mm=each.amplitude_pp_mm,
        )
        for place, each in found
    ]
    return page_of(items, limit, lambda each: each.id)


def _interval(low: float | None, high: float | None) -> list[float] | None:
    return None if low is None or high is None else [low, high]
