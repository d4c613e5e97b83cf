"""The non-dimensional quantities of a bench, Eqs. (12)-(16), and how they lie to the limits that the paper keeps.

They undo `joints.inclined_support`; what follows from them, Figs. 3 and 4, is in `conditioning`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.errors import AnalysisError
from analysis.structure.beam import RIGID_MODES, Beam, FreeBeam
from analysis.structure.joints import Joint

HIGHEST_STIFFNESS_RATIO = 50.0  # above, the condition number of Eq. (45) begins to rise: Section 6, Fig. 3
FIRST_ELASTIC = (100.0, 200.0)  # Hz, Section 2
LEAST_ASPECT_RATIO = 2.0  # R = 1 couples nothing, Section 4.2; below 2 it is less than k_t / 2 at 45 degrees
LONGEST_CONTACT = 0.05  # of the beam's length, Section 3
RIGID_ALONG = 2.0  # times the band: a longitudinal mode above is out of the way, Section 3
_ROUND = 1e-9  # principal stiffnesses that differ by less, relatively, have no direction


@dataclass(frozen=True)
class JointDesign:
    """One joint in the quantities of Section 4.2.

    Attributes:
        name: of the joint.
        stiffness_ratio: k-bar = k_t L^3 / EI, k_t being the lesser of the principal stiffnesses in translation.
        aspect_ratio: R = k_l / k_t, one or more.
        inclination: theta of the stiff axis from that of the beam, rad, above -pi/2 up to pi/2; positive where
            k12 > 0 as at joint I, and nought where no axis is stiffer than the other.
        rotation_ratio: k_theta / (k_t L^2).
        loss_factors: along the soft and along the stiff axis.
    """

    name: str
    stiffness_ratio: float
    aspect_ratio: float
    inclination: float
    rotation_ratio: float
    loss_factors: tuple[float, float]


@dataclass(frozen=True)
class BenchDesign:
    """A bench in non-dimensional quantities.

    Attributes:
        joints: in their order.
        first_elastic: frequency of the free beam's first bending mode, Hz.
        first_longitudinal: of its first longitudinal mode, Hz.
        statements: where the bench leaves what the paper keeps to, one sentence each; empty where nowhere.
    """

    joints: tuple[JointDesign, ...]
    first_elastic: float
    first_longitudinal: float
    statements: tuple[str, ...]


def joint_design(beam: Beam, joint: Joint) -> JointDesign:
    """k-bar, R and theta of a joint, from cylinders or as identified.

    Raises:
        AnalysisError: the joint does not push back in every direction, so that it has no ratios.
    """
    block = joint.dynamic_stiffness[:2, :2]
    block = (block + block.T) / 2
    stiffness, axes = np.linalg.eigh(block.real)
    soft, stiff = stiffness.tolist()
    if soft <= 0:
        raise AnalysisError(
            f"joint {joint.name} has a stiffness of {soft:.3g} N/m in one direction; ratios need it to push back in all"
        )
    along, across = axes[:, 1]
    leaning = np.arctan2(across, along) if stiff - soft > _ROUND * stiff else 0.0
    return JointDesign(
        name=joint.name,
        stiffness_ratio=float(soft / beam.stiffness_unit[0, 0]),
        aspect_ratio=stiff / soft,
        inclination=float(np.pi / 2 - (np.pi / 2 - leaning) % np.pi),
        rotation_ratio=float(joint.dynamic_stiffness[2, 2].real / (soft * beam.length**2)),
        loss_factors=(
            float(axes[:, 0] @ block.imag @ axes[:, 0] / soft),
            float(axes[:, 1] @ block.imag @ axes[:, 1] / stiff),
        ),
    )


def bench_design(
    free_beam: FreeBeam, joints: Sequence[Joint], highest_frequency: float = 1024.0, contact_length: float | None = None
) -> BenchDesign:
    """The design quantities of a bench and what speaks against it.

    Args:
        free_beam: without joints.
        joints: as planned, or as identified.
        highest_frequency: of the band that is measured, Hz.
        contact_length: of a cylinder's face along the beam, m; None where that is not to be looked at.

    Raises:
        AnalysisError: a joint does not push back in every direction.
    """
    beam = free_beam.beam
    found = tuple(joint_design(beam, joint) for joint in joints)
    first = float(free_beam.frequency[RIGID_MODES])
    longitudinal = float(np.sqrt(beam.youngs_modulus / beam.density) / (2 * beam.length))
    against = [text for joint in found for text in _against(joint)]
    low, high = FIRST_ELASTIC
    if not low <= first <= high:
        against.append(f"the first elastic mode of the free beam is at {first:.3g} Hz, not in {low:g} to {high:g} Hz")
    if longitudinal < RIGID_ALONG * highest_frequency:
        against.append(
            f"the first longitudinal mode is at {longitudinal:.4g} Hz, below {RIGID_ALONG:g} times the band of "
            f"{highest_frequency:g} Hz: the ends do not move alike along the beam"
        )
    if contact_length is not None and contact_length > LONGEST_CONTACT * beam.length:
        against.append(
            f"contacts of {contact_length:.3g} m are {contact_length / beam.length:.2g} of the beam's length, above "
            f"{LONGEST_CONTACT:g}: a joint is no longer a point"
        )
    return BenchDesign(found, first, longitudinal, tuple(against))


def _against(joint: JointDesign) -> list[str]:
    found = []
    if joint.stiffness_ratio > HIGHEST_STIFFNESS_RATIO:
        found.append(
            f"joint {joint.name}: k-bar = {joint.stiffness_ratio:.3g} is above {HIGHEST_STIFFNESS_RATIO:g}, where "
            "three modes begin to be ill-conditioned; use more modes, or a stiffer beam"
        )
    if joint.aspect_ratio < LEAST_ASPECT_RATIO:
        found.append(
            f"joint {joint.name}: R = {joint.aspect_ratio:.3g} is below {LEAST_ASPECT_RATIO:g}; it hardly couples "
            "motion along the beam to motion across it"
        )
    return found
