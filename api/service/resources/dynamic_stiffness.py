"""Dynamic stiffness: k, h and gamma of each sine point by the direct method, with standard errors."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from api.service.access import Reader
from api.service.context import Context
from api.service.documents import OfAnalysis, RunNumber, Words
from api.service.etags import TaggedRoute
from api.service.pages import Cursor, Limit, Page, number_from, page_of, page_of_whole
from api.service.problems import problems
from store.analyses import chosen_analysis
from store.dynamic_stiffness import StoredStiffness, list_dynamic_stiffness
from store.quantity import quantity
from store.result_queries import ResultIds, find_sine_points
from store.states import AnalysisKind

router = APIRouter(tags=["dynamic stiffness"], route_class=TaggedRoute)
Known = float | None
Specimen = Annotated[Words | None, Query(description="only of this joint's cylinders")]
Configuration = Annotated[Words | None, Query(description="compression, shear or angled")]


class StiffnessPoint(BaseModel):
    """One sine point; null is not known."""

    analysis_id: int
    order_number: int
    specimen: str
    configuration: str
    amplitude_pp_mm: Annotated[float, quantity("mm", "peak to peak, asked for")]
    frequency: Annotated[float, quantity("Hz")]
    stiffness: Annotated[float, quantity("N/m", "k")]
    stiffness_se: Annotated[Known, quantity("N/m", "standard error")]
    damping: Annotated[float, quantity("N/m", "h")]
    damping_se: Annotated[Known, quantity("N/m", "standard error")]
    loss_factor: Annotated[float, quantity("1", "gamma")]
    loss_factor_se: Annotated[Known, quantity("1", "standard error")]
    degrees_of_freedom: Annotated[Known, quantity("1", "behind the standard errors; null where known beforehand")]
    reached_pp_mm: Annotated[Known, quantity("mm", "peak to peak, reached by the first harmonic")]
    reached_pp_se_mm: Annotated[Known, quantity("mm", "standard error")]
    thd_percent: Annotated[Known, quantity("%", "total harmonic distortion of the force")]
    thd_se_percent: Annotated[Known, quantity("%", "standard error")]
    thd_displacement_percent: Annotated[Known, quantity("%", "total harmonic distortion of the displacement")]
    thd_displacement_se_percent: Annotated[Known, quantity("%", "standard error")]
    loop_energy: Annotated[Known, quantity("J", "of one cycle, all harmonics")]
    loop_energy_se: Annotated[Known, quantity("J", "standard error")]
    loop_energy_excess: Annotated[Known, quantity("J", "loop energy less pi X^2 h, that of the first harmonic")]
    loop_energy_excess_se: Annotated[Known, quantity("J", "standard error")]
    temperature_c: Annotated[Known, quantity("degC")]
    flags: list[str] = Field(description="what to mind about this point")

    @classmethod
    def of(cls, analysis_id: int, point: StoredStiffness) -> StiffnessPoint:
        """What is shown of a point."""
        return cls(analysis_id=analysis_id, **_shown(point))


class FoundPoint(StiffnessPoint):
    """One sine point, and where it stands."""

    id: int
    run_id: int

    @classmethod
    def at(cls, place: ResultIds, point: StoredStiffness) -> FoundPoint:
        """What is shown of a point that was searched for."""
        return cls(**place._asdict(), **_shown(point))


@router.get("/runs/{run_id}/dynamic-stiffness", responses=problems(401, 403, 404))
def of_run(
    _who: Reader,
    context: Context,
    run_id: RunNumber,
    specimen: Specimen = None,
    configuration: Configuration = None,
    analysis: OfAnalysis = None,
    limit: Limit = 1000,
    cursor: Cursor = None,
) -> Page[StiffnessPoint]:
    """The sine points of a run, the newest or those of one analysis, in the order of measuring."""
    with context.catalogue.reading() as session:
        made = chosen_analysis(session, run_id, AnalysisKind.DYNAMIC_STIFFNESS, analysis)
        found = list_dynamic_stiffness(session, made.id)
    wanted = [
        point for point in found if specimen in (None, point.specimen) and configuration in (None, point.configuration)
    ]
    page = page_of_whole(wanted, limit, cursor)
    return Page(items=[StiffnessPoint.of(made.id, point) for point in page.items], next=page.next)


@router.get("/dynamic-stiffness", responses=problems(401, 403))
def of_article(
    _who: Reader,
    context: Context,
    article: Annotated[Words, Query(description="the test article")],
    specimen: Specimen = None,
    configuration: Configuration = None,
    amplitude_pp_mm: Annotated[float | None, Query(gt=0, le=100, description="only at this amplitude, mm")] = None,
    lowest_frequency: Annotated[float | None, Query(ge=0, le=1e6, description="Hz")] = None,
    highest_frequency: Annotated[float | None, Query(ge=0, le=1e6, description="Hz")] = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Page[FoundPoint]:
    """Every sine point that was ever evaluated of an article's specimens, newest first."""
    with context.catalogue.reading() as session:
        found = find_sine_points(
            session,
            article=article,
            specimen=specimen,
            configuration=configuration,
            amplitude_pp_mm=amplitude_pp_mm,
            lowest_frequency=lowest_frequency,
            highest_frequency=highest_frequency,
            before=number_from(cursor),
            limit=limit + 1,
        )
    return page_of([FoundPoint.at(*each) for each in found], limit, lambda each: each.id)


def _shown(point: StoredStiffness) -> dict[str, Any]:
    same = set(StiffnessPoint.model_fields) - {"analysis_id", "flags"}
    return {name: getattr(point, name) for name in same} | {"flags": list(point.flags)}
