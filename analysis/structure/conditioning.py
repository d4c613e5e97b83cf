"""The design study of Section 6: conditioning and sensitivity against joint stiffness, Figs. 3 and 4.

Both vary k-bar = k_t L^3 / EI of two supports that lean inward by theta, Eq. (16).
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
class Supports:
    """Two opposed supports of the design study.

    Attributes:
        nodes: of joint I and joint II.
        aspect_ratio: R = k_l / k_t.
        inclination: theta, rad, positive at joint I and negative at joint II.
        loss_factor: of all terms.
        rotation_ratio: k_theta / (k_t L^2).
    """

    nodes: tuple[int, int] = (2, 10)
    aspect_ratio: float = 7.0
    inclination: float = np.pi / 4
    loss_factor: float = 0.1
    rotation_ratio: float = 0.0

    def joints(self, free_beam: FreeBeam, stiffness_ratio: float) -> tuple[Joint, Joint]:
        """Joints I and II at k-bar = `stiffness_ratio`."""
        lossy = stiffness_ratio * (1 + 1j * self.loss_factor)
        first, second = (
            inclined_support(
                free_beam.beam, name, node, lossy, self.aspect_ratio, sign * self.inclination, self.rotation_ratio
            )
            for name, node, sign in zip(("I", "II"), self.nodes, (1, -1), strict=True)
        )
        return first, second


PAPER_SUPPORTS = Supports()


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
    supports: Supports = PAPER_SUPPORTS,
) -> Real:
    """(points, 2) condition number of Yw, Eq. (45), for joints I and II at each k-bar, Fig. 3.

    In SI units, for all 18 unknowns, without the symmetry of Eq. (36). On ten equal elements, with a
    loss factor of 0.1, modes 1-3 give 3.9 at k-bar = 0.1, 4.2 at 10, 4.3 at 50, 5.3 at 100 and 123 at 300.

    Args:
        free_beam: with nodes at the supports.
        stiffness_ratios: (points,) k-bar, positive.
        modes: how many are used, from the lowest.
        supports: R, theta and the rest of the design.

    Raises:
        AnalysisError: the mesh has fewer modes than asked for.
    """
    dofs = [Dof(node, direction) for node in supports.nodes for direction in DIRECTIONS]
    numbers = []
    for ratio in np.asarray(stiffness_ratios, dtype=float):
        found = _lowest(free_beam, supports.joints(free_beam, ratio), modes, dofs)
        shapes = found.shapes.reshape(modes, 2, 3)
        numbers.append([regression.condition_number(shapes[:, joint]) for joint in range(2)])
    return np.array(numbers)


def eigenvalue_study(
    free_beam: FreeBeam,
    stiffness_ratios: ArrayLike,
    modes: int = 6,
    supports: Supports = PAPER_SUPPORTS,
) -> EigenvalueStudy:
    """Natural frequencies and their sensitivities against k-bar, Fig. 4.

    Args:
        free_beam: with nodes at the supports.
        stiffness_ratios: (points,) k-bar, positive.
        modes: how many, from the lowest.
        supports: R, theta and the rest of the design.

    Raises:
        AnalysisError: the mesh has fewer modes than asked for.
    """
    ratios = np.asarray(stiffness_ratios, dtype=float)
    dofs = [Dof(node, direction) for node in supports.nodes for direction in DIRECTIONS]
    frequency, sensitivity = np.empty((modes, ratios.size)), np.empty((modes, ratios.size))
    for point, ratio in enumerate(ratios):
        joints = supports.joints(free_beam, ratio)
        found = _lowest(free_beam, joints, modes, dofs)
        shapes = found.shapes.reshape(modes, 2, 3)
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
