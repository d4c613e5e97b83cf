"""Modes: natural frequencies, loss factors and shapes with their intervals."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter
from pydantic import BaseModel, Field

from api.service.access import Reader
from api.service.context import Context
from api.service.documents import OfAnalysis, RunNumber
from api.service.etags import TaggedRoute
from api.service.problems import problems
from jointlab.identification.document import plain
from store.analyses import chosen_analysis
from store.modes import get_modes
from store.quantity import quantity
from store.states import AnalysisKind

router = APIRouter(prefix="/runs/{run_id}/modes", tags=["modes"], route_class=TaggedRoute)
Known = float | None


class ModesDocument(BaseModel):
    """The modes of a run, by rising frequency; an interval is [low, high], null is not known."""

    analysis_id: int
    method: str
    frequency_hz: Annotated[list[float], quantity("Hz")]
    frequency_ci95: Annotated[list[list[Known]], quantity("Hz")]
    loss_factor: Annotated[list[float], quantity("1")]
    loss_factor_ci95: Annotated[list[list[Known]], quantity("1")]
    predicted_hz: Annotated[list[Known], quantity("Hz", "of the beam on the identified joints")]
    points: list[str] = Field(description="degrees of freedom of the shapes, such as 3y")
    shapes_real: Annotated[
        list[list[float]], quantity("1/kg", "modal constants: a row for each mode, a column for each point")
    ]
    shapes_imaginary: Annotated[list[list[float]], quantity("1/kg")]


@router.get("", responses=problems(401, 403, 404, 500))
def get(_who: Reader, context: Context, run_id: RunNumber, analysis: OfAnalysis = None) -> ModesDocument:
    """The modes of a run, the newest or those of one analysis."""
    with context.catalogue.reading() as session:
        made = chosen_analysis(session, run_id, AnalysisKind.MODES, analysis)
        found = get_modes(session, made.id)
    return ModesDocument(
        analysis_id=made.id,
        method=made.method,
        frequency_hz=plain(found.frequency),
        frequency_ci95=plain(found.frequency_ci95),
        loss_factor=plain(found.loss_factor),
        loss_factor_ci95=plain(found.loss_factor_ci95),
        predicted_hz=plain(found.predicted_frequency),
        points=[str(dof) for dof in found.dofs],
        shapes_real=plain(found.shapes.real),
        shapes_imaginary=plain(found.shapes.imag),
    )
