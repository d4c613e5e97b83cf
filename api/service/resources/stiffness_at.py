"""Dynamic stiffness where nothing was measured: the fitted law of each joint at one amplitude and frequency."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from analysis.direct.cylinder_terms import JointTerms
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.specimen_scatter import Scatter, SpecimenScatter
from api.service.access import Reader
from api.service.context import Context
from api.service.documents import RunNumber, Words
from api.service.etags import TaggedRoute
from api.service.problems import problems
from jointlab.identification.law import SpecimenAt, StiffnessAt, laws_of_points, points_of_run, stiffness_at
from store.quantity import quantity

router = APIRouter(tags=["dynamic stiffness"], route_class=TaggedRoute)
LARGEST_AMPLITUDE = 100.0
"""mm peak to peak."""
HIGHEST_FREQUENCY = 1e6
"""Hz."""


class TermDocument(BaseModel):
    """One complex stiffness; intervals are [low, high] and hold 95 %."""

    k: Annotated[float, quantity("N/m")]
    k_ci95: Annotated[tuple[float, float], quantity("N/m")]
    h: Annotated[float, quantity("N/m")]
    h_ci95: Annotated[tuple[float, float], quantity("N/m")]
    gamma: Annotated[float, quantity("1")]
    gamma_ci95: Annotated[tuple[float, float], quantity("1")]

    @classmethod
    def of(cls, found: DynamicStiffness) -> TermDocument:
        """What is shown of a term."""
        return cls(
            k=found.stiffness,
            k_ci95=found.stiffness_estimate.interval(),
            h=found.damping,
            h_ci95=found.damping_estimate.interval(),
            gamma=found.loss_factor,
            gamma_ci95=found.loss_factor_estimate.interval(),
        )


class JointDocument(BaseModel):
    """Translational terms of a joint of two such cylinders."""

    k11: TermDocument
    k22: TermDocument
    k12: TermDocument

    @classmethod
    def of(cls, terms: JointTerms) -> JointDocument:
        """What is shown of a joint."""
        return cls(k11=TermDocument.of(terms.k11), k22=TermDocument.of(terms.k22), k12=TermDocument.of(terms.k12))


class SpecimenDocument(BaseModel):
    """One specimen by its own law."""

    specimen: str
    shear: TermDocument = Field(description="a of one cylinder")
    compression: TermDocument = Field(description="b of one cylinder")
    joint: JointDocument
    beyond: list[str] = Field(description="in which way this is outside of what was measured; empty inside")

    @classmethod
    def of(cls, found: SpecimenAt) -> SpecimenDocument:
        """What is shown of a specimen."""
        return cls(
            specimen=found.specimen,
            shear=TermDocument.of(found.cylinder.shear),
            compression=TermDocument.of(found.cylinder.compression),
            joint=JointDocument.of(found.joint),
            beyond=list(found.beyond),
        )


class ScatterDocument(BaseModel):
    """One quantity over specimens."""

    unit: Literal["N/m", "1"]
    mean: float
    mean_ci95: tuple[float, float]
    deviation: float = Field(description="standard deviation between specimens")
    single_specimen_ci95: tuple[float, float] = Field(description="where another specimen of the kind lies")

    @classmethod
    def of(cls, found: Scatter, unit: Literal["N/m", "1"]) -> ScatterDocument:
        """What is shown of a quantity."""
        return cls(
            unit=unit,
            mean=found.mean.value,
            mean_ci95=found.mean.interval(),
            deviation=found.deviation,
            single_specimen_ci95=found.next_specimen.interval(),
        )


class TermScatterDocument(BaseModel):
    """One term of a cylinder over specimens: k and h in N/m, and gamma."""

    k: ScatterDocument
    h: ScatterDocument
    gamma: ScatterDocument

    @classmethod
    def of(cls, stiffness: Scatter, damping: Scatter, loss_factor: Scatter) -> TermScatterDocument:
        """What is shown of a term."""
        return cls(
            k=ScatterDocument.of(stiffness, "N/m"),
            h=ScatterDocument.of(damping, "N/m"),
            gamma=ScatterDocument.of(loss_factor, "1"),
        )


class SpecimensDocument(BaseModel):
    """What specimens differ by, taken to be of one kind."""

    specimens: list[str]
    shear: TermScatterDocument
    compression: TermScatterDocument

    @classmethod
    def of(cls, found: SpecimenScatter) -> SpecimensDocument:
        """What is shown of the scatter."""
        return cls(
            specimens=list(found.specimens),
            shear=TermScatterDocument.of(found.shear, found.shear_damping, found.shear_loss_factor),
            compression=TermScatterDocument.of(
                found.compression, found.compression_damping, found.compression_loss_factor
            ),
        )


class StiffnessDocument(BaseModel):
    """Dynamic stiffness at one amplitude and frequency, by the fitted laws."""

    analysis_id: int | None = Field(description="of the points behind it; null where they are a bundle's")
    amplitude_pp_mm: Annotated[float, quantity("mm", "peak to peak")]
    frequency: Annotated[float, quantity("Hz")]
    extrapolated: bool = Field(description="whether this is outside of what was measured of any specimen")
    specimens: list[SpecimenDocument]
    scatter: SpecimensDocument | None = Field(description="null for one specimen alone")

    @classmethod
    def of(cls, found: StiffnessAt, analysis_id: int | None) -> StiffnessDocument:
        """What is shown of an answer."""
        return cls(
            analysis_id=analysis_id,
            amplitude_pp_mm=1e3 * found.amplitude_pp,
            frequency=found.frequency,
            extrapolated=any(each.beyond for each in found.specimens),
            specimens=[SpecimenDocument.of(each) for each in found.specimens],
            scatter=None if found.scatter is None else SpecimensDocument.of(found.scatter),
        )


@router.get("/runs/{run_id}/dynamic-stiffness/at", responses=problems(401, 403, 404))
def at(
    _who: Reader,
    context: Context,
    run_id: RunNumber,
    amplitude_pp_mm: Annotated[
        float, Query(gt=0, le=LARGEST_AMPLITUDE, description="peak to peak, mm", examples=[0.03])
    ],
    frequency: Annotated[float, Query(gt=0, le=HIGHEST_FREQUENCY, description="Hz", examples=[80])],
    specimen: Annotated[
        list[Words] | None, Query(description="only these joints' cylinders; repeat for several")
    ] = None,
) -> StiffnessDocument:
    """The fitted law of each joint at any amplitude and frequency, and what a single specimen of the kind may have.

    The law goes through the newest sine points of the run. It is fitted when it is first asked for, which takes a
    second for a whole sweep of two joints, and kept.
    """
    analysis = points_of_run(context.catalogue, run_id)
    laws = laws_of_points(context.catalogue, run_id, analysis)
    return StiffnessDocument.of(stiffness_at(laws, 1e-3 * amplitude_pp_mm, frequency, specimen or ()), analysis)
