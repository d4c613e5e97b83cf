"""The design study of Section 6: conditioning and sensitivity against joint stiffness, Figs. 3 and 4.

Both vary k-bar = k_t L^3 / EI of all supports together, Eq. (16); the paper's two lean inward by theta.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.inverse import regression
from analysis.inverse.expansion import joint_degrees
from analysis.modes import Modes
from analysis.structure.beam import DIRECTIONS, RIGID_MODES, FreeBeam
from analysis.structure.forward import eigensolution
from analysis.structure.joints import Joint, inclined_support

MARGIN = 1.2  # modes are sought so far above the highest one of the same supports without loss


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
        stiffness_ratio: (points,) k-bar.
        frequency: (modes, points) w_r by that of the first elastic mode of the free beam.
        sensitivity: (modes, points) d ln w_r / d ln k-bar: 1/2 where the joints alone are the spring, 0 where
            the mode does not feel them.
    """

    stiffness_ratio: Real
    frequency: Real
    sensitivity: Real


def condition_numbers(
    free_beam: FreeBeam,
    stiffness_ratios: ArrayLike,
    modes: int,
    supports: Sequence[Support] = PAPER_SUPPORTS,
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
    dofs = [Dof(support.node, direction) for support in supports for direction in DIRECTIONS]
    numbers = []
    for ratio in np.asarray(stiffness_ratios, dtype=float):
        joints = [support.joint(free_beam, ratio) for support in supports]
        shapes = _lowest(free_beam, joints, modes, dofs).shapes.reshape(modes, len(joints), 3)
        numbers.append([regression.condition_number(shapes[:, place]) for place in range(len(joints))])
    return np.array(numbers)


def eigenvalue_study(
    free_beam: FreeBeam,
    stiffness_ratios: ArrayLike,
    modes: int = 6,
    supports: Sequence[Support] = PAPER_SUPPORTS,
) -> EigenvalueStudy:
    """Natural frequencies and their sensitivities against k-bar, Fig. 4.

    Args:
        free_beam: with nodes at the supports.
        stiffness_ratios: (points,) k-bar, positive.
        modes: how many, from the lowest.
        supports: any number, all at the same k-bar.

    Raises:
        AnalysisError: the mesh has fewer modes than asked for.
    """
    ratios = np.asarray(stiffness_ratios, dtype=float)
    dofs = [Dof(support.node, direction) for support in supports for direction in DIRECTIONS]
    frequency, sensitivity = np.empty((modes, ratios.size)), np.empty((modes, ratios.size))
    for point, ratio in enumerate(ratios):
        joints = [support.joint(free_beam, ratio) for support in supports]
        found = _lowest(free_beam, joints, modes, dofs)
        shapes = found.shapes.reshape(modes, len(joints), 3)
        # unit modal mass: d lambda = -psi^T dz psi / (2 lambda), and dz = z d ln k-bar
        energy = sum(
            np.einsum("mp,pq,mq->m", shapes[:, place], joint.dynamic_stiffness, shapes[:, place])
            for place, joint in enumerate(joints)
        )
        squared = -(found.poles**2)
        frequency[:, point] = found.frequency / free_beam.frequency[RIGID_MODES]
        sensitivity[:, point] = np.real(energy) / (2 * squared.real)
    return EigenvalueStudy(ratios, frequency, sensitivity)


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
