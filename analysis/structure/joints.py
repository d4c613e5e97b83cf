"""Joints: dynamic stiffness matrices from cylinders or from ratios, Eqs. (8)-(16), and their tests.

A joint's matrix acts on (x, y, rotation) at its node: N/m, N and N m. Signs: theta and eccentricity
are those of Eq. (10), the lower cylinder lies at -e and the upper at +e. Leaning -45 and 135 degrees
they give k12 > 0, as at joint I of Table 2; leaning 45 and -135 degrees, k12 < 0, as at joint II.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.structure.beam import Beam

SHORTEST_LEVER = 1e-6  # m; a rotational stiffness below k times its square is none


@dataclass(frozen=True)
class Cylinder:
    """An elastomeric cylinder grounded at one end, in its own axes; k(1 + i gamma) where it is lossy.

    Attributes:
        shear: a, N/m.
        compression: b, N/m.
        rotation: c, N m.
        coupling: d between rotation and shear, N.
    """

    shear: complex
    compression: complex
    rotation: complex = 0.0
    coupling: complex = 0.0

    @property
    def matrix(self) -> Complex:
        """(3, 3) Eq. (8)."""
        a, b, c, d = self.shear, self.compression, self.rotation, self.coupling
        return np.array([[a, 0, d], [0, b, 0], [d, 0, c]], dtype=complex)


@dataclass(frozen=True, eq=False)
class Joint:
    """A support between a node of the beam and the ground.

    Its known mass, such as metal caps, belongs to the beam: see `point_masses` of `beam.assemble`.

    Attributes:
        name: such as "I".
        node: node of the beam, numbered from 1.
        dynamic_stiffness: (3, 3) k + i h over x, y, rotation; N/m, N, N m.

    Raises:
        AnalysisError: the matrix is not 3 by 3 or not finite.
    """

    name: str
    node: int
    dynamic_stiffness: Complex

    def __post_init__(self) -> None:
        if self.dynamic_stiffness.shape != (3, 3) or not np.all(np.isfinite(self.dynamic_stiffness)):
            raise AnalysisError(f"joint {self.name} needs a dynamic stiffness matrix of 3 by 3 finite numbers")


def effective_stiffness(cylinder: Cylinder, inclination: float, eccentricity: float) -> Complex:
    """(3, 3) stiffness of one cylinder at the beam's node, Eqs. (9), (10).

    Args:
        cylinder: in its own axes.
        inclination: theta, rad.
        eccentricity: epsilon, m from the neutral axis.
    """
    cosine, sine = np.cos(inclination), np.sin(inclination)
    turn = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    offset = np.array([[1, 0, 0], [0, 1, 0], [-eccentricity, 0, 1]])
    return np.asarray(offset @ turn.T @ cylinder.matrix @ turn @ offset.T)


def joint_from_cylinders(
    name: str, node: int, cylinders: Sequence[Cylinder], inclinations: Sequence[float] | Real, eccentricity: float
) -> Joint:
    """A joint of a lower and an upper cylinder, Eq. (11).

    Args:
        name: of the joint.
        node: of the beam, numbered from 1.
        cylinders: (2,) lower and upper.
        inclinations: (2,) theta of the lower and the upper cylinder, rad.
        eccentricity: of both, m; the lower counts as minus it.

    Raises:
        AnalysisError: there are not two cylinders with an inclination each.
    """
    if len(cylinders) != 2 or len(inclinations) != 2:
        raise AnalysisError(f"joint {name} needs a lower and an upper cylinder with an inclination each")
    lower, upper = (
        effective_stiffness(cylinder, theta, offset)
        for cylinder, theta, offset in zip(cylinders, inclinations, (-eccentricity, eccentricity), strict=True)
    )
    return Joint(name, node, lower + upper)


def inclined_support(
    beam: Beam,
    name: str,
    node: int,
    stiffness_ratio: complex,
    aspect_ratio: float,
    inclination: float,
    rotation_ratio: float = 0.0,
) -> Joint:
    """The support of the design study, Eqs. (12)-(16): stiff along one axis, which leans by theta.

    At 45 degrees this is Eq. (16), where cos^2 45 is already in the factor 1/2; theta = 45 degrees
    is joint I and theta = -45 degrees joint II.

    Args:
        beam: its EI/L^3 is the unit of stiffness.
        name: of the joint.
        node: of the beam, numbered from 1.
        stiffness_ratio: k-bar = k_t L^3 / EI, complex where the support is lossy.
        aspect_ratio: R = k_l / k_t.
        inclination: theta, rad.
        rotation_ratio: k_theta / (k_t L^2).
    """
    transverse = stiffness_ratio * beam.flexural_rigidity / beam.length**3
    leaning = Cylinder(
        shear=aspect_ratio * transverse,  # the first axis of Eq. (8), here the stiff one as in Eq. (12)
        compression=transverse,
        rotation=rotation_ratio * transverse * beam.length**2,
    )
    # Eq. (9) turns by theta^-1, Eqs. (13)-(15) by theta; the sign of k12 is all that differs
    return Joint(name, node, effective_stiffness(leaning, inclination, eccentricity=0.0))


def least_loss(dynamic_stiffness: Complex) -> tuple[float, Complex]:
    """The least eigenvalue of (z - z^H) / 2i as a share of stiffness, and the motion u (3,) that loses so little.

    Negative says that u draws energy from the joint: its loss is u^H (z - z^H) / 2i u.
    """
    lost = (dynamic_stiffness - dynamic_stiffness.conj().T) / 2j
    losses, motions = np.linalg.eigh(_dimensionless(lost, dynamic_stiffness))
    scale = np.real(np.diag(_dimensionless(np.eye(3, dtype=complex), dynamic_stiffness)))
    return float(losses[0]), np.asarray(motions[:, 0] * np.sqrt(scale))


def least_stiffness(dynamic_stiffness: Complex) -> tuple[float, Complex]:
    """The least eigenvalue of k, scaled to a unit diagonal of the dynamic stiffness, and the motion u (3,) that has it.

    If it is negative, the joint pushes the motion on instead of resisting it.
    """
    elastic = (dynamic_stiffness + dynamic_stiffness.conj().T) / 2
    values, motions = np.linalg.eigh(_dimensionless(elastic, dynamic_stiffness))
    scale = np.real(np.diag(_dimensionless(np.eye(3, dtype=complex), dynamic_stiffness)))
    return float(values[0]), np.asarray(motions[:, 0] * np.sqrt(scale))


def _dimensionless(matrix: Complex, stiffness: Complex) -> Complex:
    """`matrix` scaled to a unit diagonal of `stiffness`, so that translation and rotation weigh alike."""
    scale = np.sqrt(np.abs(np.diag(stiffness)))
    least = SHORTEST_LEVER * np.max(scale)
    return matrix / np.outer(*2 * [np.maximum(scale, least if least > 0 else 1.0)])
