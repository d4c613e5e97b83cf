"""Accelerances of roving-hammer sets."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from fastapi import APIRouter, Path
from pydantic import BaseModel, Field

from api.service.access import Reader
from api.service.context import Context
from api.service.documents import OfAnalysis, RunNumber
from api.service.etags import TaggedRoute
from api.service.pages import Cursor, Limit, Page, page_of_whole
from api.service.problems import problems
from jointlab.identification.document import plain
from store.errors import NotFoundError
from store.excitation import Excitation
from store.frequency_responses import FrequencyResponseSet, list_frequency_responses
from store.quantity import quantity

router = APIRouter(prefix="/runs/{run_id}/frequency-responses", tags=["FRFs"], route_class=TaggedRoute)
Numbers = list[float]
UNIT = "(m/s^2)/N"


class SetSummary(BaseModel):
    """One set: where was struck or shaken, and how."""

    number: int
    excitation: Excitation = Field(description="by a roving hammer, or by a shaker that stays")
    response: str = Field(description="where the accelerometer sat, such as 3y; of a sine, where the shaker pushed")
    inputs: list[str] = Field(description="where the hammer struck; of a sine, where the accelerometer went")
    lines: int
    highest_frequency: Annotated[float, quantity("Hz")]
    averages: int
    peak_force: Annotated[float, quantity("N", "of the blows, or amplitude of the sine")]
    temperature_c: Annotated[float, quantity("degC")]
    window: str
    sample_rate: Annotated[float, quantity("Hz")]
    block_seconds: Annotated[float, quantity("s", "length of a record")]
    estimator: str

    @classmethod
    def of(cls, found: FrequencyResponseSet) -> SetSummary:
        """What is shown of a set."""
        same = ("number", "averages", "peak_force", "temperature_c", "window", "sample_rate", "block_seconds")
        return cls(
            **{name: getattr(found, name) for name in same},
            estimator=found.estimator,
            excitation=found.excitation,
            response=str(found.response),
            inputs=[str(point) for point in found.inputs],
            lines=int(found.frequency.size),
            highest_frequency=float(found.frequency[-1]),
        )


class FrequencyResponseDocument(BaseModel):
    """One accelerance over frequency."""

    response: str
    input: str
    frequency: Annotated[Numbers, quantity("Hz")]
    real: Annotated[Numbers, quantity(UNIT)]
    imaginary: Annotated[Numbers, quantity(UNIT)]
    coherence: Annotated[list[float | None] | None, quantity("1", "0 to 1; null where it was not measured")]
    variance: Annotated[
        list[float | None] | None, quantity("((m/s^2)/N)^2", "of the real and of the imaginary part; null: not known")
    ]


@router.get("", responses=problems(401, 403, 404, 500))
def list_(
    _who: Reader,
    context: Context,
    run_id: RunNumber,
    analysis: OfAnalysis = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Page[SetSummary]:
    """The accelerances of a run, the newest or those of one analysis, set by set."""
    with context.catalogue.reading() as session:
        sets = list_frequency_responses(session, run_id, analysis)
    return page_of_whole([SetSummary.of(found) for found in sets], limit, cursor)


@router.get("/{set_number}/{point}", responses=problems(401, 403, 404, 500))
def get(
    _who: Reader,
    context: Context,
    run_id: RunNumber,
    set_number: Annotated[int, Path(ge=1, le=10_000, description="number of the set, from 1")],
    point: Annotated[str, Path(pattern=r"^[1-9][0-9]{0,5}[xyr]$", description="where the hammer struck, such as 3y")],
    analysis: OfAnalysis = None,
) -> FrequencyResponseDocument:
    """The accelerance of a run from one blow point, the newest or that of one analysis."""
    with context.catalogue.reading() as session:
        sets = list_frequency_responses(session, run_id, analysis)
    for found in sets:
        if found.number == set_number and point in map(str, found.inputs):
            row = [str(each) for each in found.inputs].index(point)
            accelerance = np.asarray(found.accelerance[row])
            return FrequencyResponseDocument(
                response=str(found.response),
                input=point,
                frequency=found.frequency.tolist(),
                real=accelerance.real.tolist(),
                imaginary=accelerance.imag.tolist(),
                coherence=None if found.coherence is None else plain(found.coherence[row]),
                variance=None if found.variance is None else plain(found.variance[row]),
            )
    raise NotFoundError(f"run {run_id} has no accelerance of set {set_number} from {point}")
