"""The beam free of its joints, in soft cords: its modes, its damping and its material (Table 1)."""

from dataclasses import dataclass

from analysis.modal.estimation import ModalEstimate, estimate_modes
from analysis.modal.modal_model import DampingKind
from analysis.suspended.beam_update import BeamTolerances
from analysis.suspended.characterisation import FreeBeamResult, characterise_free_beam
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.structure import beam_of, mesh_of

LOWEST_LINE = 20.0  # Hz; above the rigid-body modes of a beam in soft cords


@dataclass(frozen=True, eq=False)
class SuspendedBeam:
    """Results of the suspended beam.

    Attributes:
        modal: its measured modes, viscous.
        result: Table 1, damping, and the beam after the update.
    """

    modal: ModalEstimate
    result: FreeBeamResult


def suspended_beam_of(measurement: MeasuredArticle, elements: int | None = None) -> SuspendedBeam | None:
    """Evaluate the suspended test of a measurement; None without one.

    Args:
        measurement: with or without such a test.
        elements: of the beam between neighbouring nodes, see `structure.mesh_of`.

    Raises:
        AnalysisError: no elastic mode of this beam is found, or the beam cannot be updated.
    """
    test = measurement.suspended
    if test is None:
        return None
    article = measurement.article
    highest = float(test.responses.frequency[-1])
    modal = estimate_modes(test.responses, (LOWEST_LINE, highest), damping=DampingKind.VISCOUS)
    result = characterise_free_beam(
        modal.modes,
        beam_of(article),
        mesh_of(article, elements),
        BeamTolerances(youngs_modulus=article.tolerances.youngs_modulus, density=article.tolerances.density),
        suspension=test.suspension,
        point_masses={article.accelerometer.node: article.accelerometer.mass},
        weighed=test.weighed,
    )
    return SuspendedBeam(modal, result)
