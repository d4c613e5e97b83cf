"""The document of a dynamic stiffness that fitted laws give, for the service and for `jointlab stiffness --json`."""

from typing import Literal

from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.specimen_scatter import Scatter, SpecimenScatter
from jointlab.documents.stiffness import (
    JointDocument,
    ScatterDocument,
    SpecimensDocument,
    SpecimenStiffness,
    StiffnessDocument,
    TermDocument,
    TermScatterDocument,
)
from jointlab.identification.law import SpecimenAt, StiffnessAt


def stiffness_document(found: StiffnessAt, analysis_id: int | None) -> StiffnessDocument:
    """The document of an answer; `analysis_id` is of the sine points behind it, None where they are a bundle's."""
    return StiffnessDocument(
        analysis_id=analysis_id,
        amplitude_pp_mm=1e3 * found.amplitude_pp,
        frequency=found.frequency,
        extrapolated=any(each.beyond for each in found.specimens),
        specimens=[_specimen(each) for each in found.specimens],
        scatter=None if found.scatter is None else _scatter_of_specimens(found.scatter),
    )


def _specimen(found: SpecimenAt) -> SpecimenStiffness:
    joint = found.joint
    return SpecimenStiffness(
        specimen=found.specimen,
        shear=_term(found.cylinder.shear),
        compression=_term(found.cylinder.compression),
        joint=JointDocument(k11=_term(joint.k11), k22=_term(joint.k22), k12=_term(joint.k12)),
        beyond=list(found.beyond),
        notices=list(found.notices),
        contradicted=found.contradicted,
    )


def _term(found: DynamicStiffness) -> TermDocument:
    return TermDocument(
        k=found.stiffness,
        k_ci95=found.stiffness_estimate.interval(),
        h=found.damping,
        h_ci95=found.damping_estimate.interval(),
        gamma=found.loss_factor,
        gamma_ci95=found.loss_factor_estimate.interval(),
    )


def _scatter_of_specimens(found: SpecimenScatter) -> SpecimensDocument:
    return SpecimensDocument(
        specimens=list(found.specimens),
        shear=_scatter_of_term(found.shear, found.shear_damping, found.shear_loss_factor),
        compression=_scatter_of_term(found.compression, found.compression_damping, found.compression_loss_factor),
    )


def _scatter_of_term(stiffness: Scatter, damping: Scatter, loss_factor: Scatter) -> TermScatterDocument:
    return TermScatterDocument(
        k=_scatter(stiffness, "N/m"), h=_scatter(damping, "N/m"), gamma=_scatter(loss_factor, "1")
    )


def _scatter(found: Scatter, unit: Literal["N/m", "1"]) -> ScatterDocument:
    return ScatterDocument(
        unit=unit,
        mean=found.mean.value,
        mean_ci95=found.mean.interval(),
        deviation=found.deviation,
        single_specimen_ci95=found.next_specimen.interval(),
    )
