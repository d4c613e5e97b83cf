"""Design of a bench: non-dimensional quantities of Eqs. (12)-(16) and their limits, and the study of Figs. 3 and 4.

`joint_design` inverts `joints.inclined_support`. The study of Section 6 varies k-bar = k_t L^3 / EI of all supports
together, Eq. (16); the paper's two supports lean inward by theta.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.inverse import regression
from analysis.inverse.expansion import joint_degrees
from analysis.modes import Modes
from analysis.structure.beam import DIRECTIONS, Beam, FreeBeam
from analysis.structure.forward import eigensolution
from analysis.structure.joints import Joint, inclined_support
from analysis.structure.setup import RIGID_MODES

HIGHEST_STIFFNESS_RATIO = 50.0  # above, the condition number of Eq. (45) begins to rise: Section 6, Fig. 3
FIRST_ELASTIC = (100.0, 200.0)  # Hz, Section 2
LEAST_ASPECT_RATIO = 2.0  # R = 1 couples nothing, Section 4.2; below 2 it is less than k_t / 2 at 45 degrees
RIGID_ALONG = 2.0  # times the band: a longitudinal mode above is out of the way, Section 3
_ROUND = 1e-9  # principal stiffnesses that differ by less, relatively, have no direction
MARGIN = 1.2  # times the highest mode of the same supports without loss, up to which modes are searched


@dataclass(frozen=True)
class JointDesign:
    """One joint in the quantities of Section 4.2.

    Attributes:
        name: of the joint.
        stiffness_ratio: k-bar = k_t L^3 / EI, k_t being the lesser of the principal stiffnesses in translation.
        aspect_ratio: R = k_l / k_t, one or more.
        inclination: theta of the stiff axis from that of the beam, rad, above -pi/2 up to pi/2; positive where
            k12 > 0 as at joint I, and zero where no axis is stiffer than the other.
        rotation_ratio: k_theta / (k_t L^2).
    """

    name: str
    stiffness_ratio: float
    aspect_ratio: float
    inclination: float
    rotation_ratio: float


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
    )


def bench_design(free_beam: FreeBeam, joints: Sequence[Joint], highest_frequency: float = 1024.0) -> BenchDesign:
    """The design quantities of a bench and what speaks against it.

    Args:
        free_beam: without joints.
        joints: as planned, or as identified.
        highest_frequency: of the band that is measured, Hz.

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


@dataclass(frozen=True)
class Support:
    """One support of the design study.

    Attributes:
        name: of the joint that it stands for.
        node: where it is.
        aspect_ratio: R = k_l / k_t.
        inclination: theta, rad; positive at joint I and negative at joint II of the paper.
        loss_factor: of all terms.
        rotation_ratio: k_theta / (k_t L^2).
    """

    name: str
    node: int
    aspect_ratio: float = 7.0
    inclination: float = np.pi / 4
    loss_factor: float = 0.1
    rotation_ratio: float = 0.0

    def joint(self, free_beam: FreeBeam, stiffness_ratio: float) -> Joint:
        """The joint at k-bar = `stiffness_ratio`."""
        lossy = stiffness_ratio * (1 + 1j * self.loss_factor)
        return inclined_support(
            free_beam.beam, self.name, self.node, lossy, self.aspect_ratio, self.inclination, self.rotation_ratio
        )


PAPER_SUPPORTS = (Support("I", 2), Support("II", 10, inclination=-np.pi / 4))


@dataclass(frozen=True, eq=False)
class EigenvalueStudy:
    """Fig. 4: how the natural frequencies follow the joints.

    Attributes:
        frequency: (modes, points) w_r by that of the first elastic mode of the free beam.
        sensitivity: (modes, points) d ln w_r / d ln k-bar: 1/2 where the joints alone are the spring, 0 where
            the mode does not feel them.
    """

    frequency: Real
    sensitivity: Real


def condition_numbers(
    free_beam: FreeBeam, stiffness_ratios: ArrayLike, modes: int, supports: Sequence[Support] = PAPER_SUPPORTS
) -> Real:
    """(points, supports) condition number of Yw, Eq. (45), for each support at each k-bar, Fig. 3.

    In SI units, for all 18 unknowns, without the symmetry of Eq. (36). On ten equal elements, with a
    loss factor of 0.1, modes 1-3 give 3.9 at k-bar = 0.1, 4.2 at 10, 4.3 at 50, 5.3 at 100 and 123 at 300.

    Args:
        free_beam: with nodes at the supports.
        stiffness_ratios: (points,) k-bar, positive.
        modes: how many are used, from the lowest.
        supports: any number, all at the same k-bar.

    Raises:
        AnalysisError: the mesh has fewer modes than asked for.
    """
    ratios = np.asarray(stiffness_ratios, dtype=float)
    return np.array(
        [
            [regression.condition_number(shapes[:, place]) for place in range(len(supports))]
            for _, _, shapes in _swept(free_beam, ratios, modes, supports)
        ]
    )


def eigenvalue_study(
    free_beam: FreeBeam, stiffness_ratios: ArrayLike, modes: int = 6, supports: Sequence[Support] = PAPER_SUPPORTS
) -> EigenvalueStudy:
    """Natural frequencies and their sensitivities against k-bar, Fig. 4; arguments as of `condition_numbers`."""
    ratios = np.asarray(stiffness_ratios, dtype=float)
    frequency, sensitivity = np.empty((modes, ratios.size)), np.empty((modes, ratios.size))
    for point, (joints, found, shapes) in enumerate(_swept(free_beam, ratios, modes, supports)):
        # unit modal mass: d lambda = -psi^T dz psi / (2 lambda), and dz = z d ln k-bar
        energy = sum(
            np.einsum("mp,pq,mq->m", shapes[:, place], joint.dynamic_stiffness, shapes[:, place])
            for place, joint in enumerate(joints)
        )
        squared = -(found.poles**2)
        frequency[:, point] = found.frequency / free_beam.frequency[RIGID_MODES]
        sensitivity[:, point] = np.real(energy) / (2 * squared.real)
    return EigenvalueStudy(frequency, sensitivity)


def _swept(
    free_beam: FreeBeam, ratios: Real, modes: int, supports: Sequence[Support]
) -> Iterator[tuple[list[Joint], Modes, Complex]]:
    """At each k-bar the joints, their lowest modes, and (modes, joints, 3) shapes at the joints."""
    dofs = [Dof(support.node, direction) for support in supports for direction in DIRECTIONS]
    for ratio in ratios:
        joints = [support.joint(free_beam, ratio) for support in supports]
        found = _lowest(free_beam, joints, modes, dofs)
        yield joints, found, found.shapes.reshape(modes, len(joints), 3)


def _lowest(free_beam: FreeBeam, joints: Sequence[Joint], modes: int, dofs: Sequence[Dof]) -> Modes:
    """The `modes` lowest modes on `joints`."""
    if modes > free_beam.frequency.size:
        raise AnalysisError(f"{modes} modes are too many for a mesh of {free_beam.frequency.size} freedoms")
    at_joints = free_beam.shapes[joint_degrees(free_beam, [joint.node for joint in joints])]
    elastic = block_diag(*(joint.dynamic_stiffness.real for joint in joints))
    lossless = np.linalg.eigvalsh(np.diag(free_beam.squared_frequency) + at_joints.T @ elastic @ at_joints)
    limit = MARGIN * float(np.sqrt(max(lossless[modes - 1], 0.0))) / (2 * np.pi)
    found = eigensolution(free_beam, joints, limit, dofs)
    if found.poles.size < modes:
        raise AnalysisError(f"only {found.poles.size} of {modes} modes oscillate on these supports")
    return Modes(found.poles[:modes], found.shapes[:modes], found.dofs)
