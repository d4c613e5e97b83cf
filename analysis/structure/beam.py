"""The free beam: its material, its nodes, its matrices M, C, K and its free modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh

from analysis.dof import Direction, Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.structure import element
from analysis.structure.setup import RIGID_MODES, check_damping, check_span

DIRECTIONS = tuple(Direction)
"""Order of the freedoms at a node, and of the rows of a joint matrix: x, y, rotation."""
SHIFT = (2 * np.pi * 100.0) ** 2  # rad^2/s^2, makes the stiffness of a free beam definite


class Theory(StrEnum):
    """Timoshenko's beam, or Euler and Bernoulli's: no shear flexibility, no rotary inertia."""

    TIMOSHENKO = "timoshenko"
    EULER_BERNOULLI = "euler_bernoulli"


@dataclass(frozen=True)
class Beam:
    """A uniform beam of rectangular section: lengths in m, Young's modulus in Pa, density in kg/m^3.

    Raises:
        AnalysisError: a value is not positive and finite, or Poisson's ratio is outside -1..0.5.
    """

    length: float
    height: float
    width: float
    youngs_modulus: float
    poisson_ratio: float
    density: float

    def __post_init__(self) -> None:
        for name in ("length", "height", "width", "youngs_modulus", "density"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise AnalysisError(f"the beam's {name} is {value}; it must be a positive number in SI units")
        if not -1 < self.poisson_ratio <= 0.5:
            raise AnalysisError(f"the beam's poisson_ratio is {self.poisson_ratio}; it must lie between -1 and 0.5")

    @property
    def area(self) -> float:
        """Cross-sectional area A, m^2."""
        return self.height * self.width

    @property
    def second_moment(self) -> float:
        """Second moment of area I for bending in the plane of the height, m^4."""
        return self.width * self.height**3 / 12

    @property
    def shear_correction(self) -> float:
        """Shear correction factor kappa of a rectangular section, Eq. (5)."""
        return 10 * (1 + self.poisson_ratio) / (12 + 11 * self.poisson_ratio)

    @property
    def flexural_rigidity(self) -> float:
        """E I in N m^2."""
        return self.youngs_modulus * self.second_moment

    @property
    def stiffness_unit(self) -> Real:
        """(3, 3) units by which Table 2 divides a joint matrix: EI/L^3 in N/m, EI/L^2 in N, EI/L in N m."""
        lever = np.array([1.0, 1.0, self.length])
        return np.asarray(self.flexural_rigidity / self.length**3 * np.outer(lever, lever))

    def shear_flexibility(self, element_length: float) -> float:
        """Ratio phi of bending to shear stiffness of an element, Eq. (4)."""
        return float(
            24 / element_length**2 * self.second_moment / (self.shear_correction * self.area) * (1 + self.poisson_ratio)
        )


@dataclass(frozen=True, eq=False)
class Mesh:
    """Where the nodes of the elements lie, and which of them carry the paper's node numbers.

    Attributes:
        positions: (mesh nodes,) in m from the left end, rising.
        named: for node 1, 2, ... of the measurement, its place in `positions`.
    """

    positions: Real
    named: tuple[int, ...]

    @classmethod
    def through(cls, node_positions: ArrayLike, elements_between: int = 4) -> Mesh:
        """A mesh with a node at each of `node_positions`, m, and equal elements between neighbours.

        One element between neighbours is the paper's mesh. With ten elements the third free mode
        of its beam comes out 0.19 % high, with four times as many 0.008 %.

        Raises:
            AnalysisError: fewer than two positions, positions that do not rise, or no element.
        """
        nodes = np.asarray(node_positions, dtype=float)
        if nodes.ndim != 1 or nodes.size < 2 or not np.all(np.isfinite(nodes)) or np.any(np.diff(nodes) <= 0):
            raise AnalysisError(f"node positions must be two or more rising numbers in m, not {nodes.tolist()}")
        if elements_between < 1:
            raise AnalysisError(f"{elements_between} elements between nodes; there must be at least one")
        steps = np.arange(elements_between * (nodes.size - 1) + 1) / elements_between
        return cls(np.interp(steps, np.arange(nodes.size), nodes), tuple(range(0, steps.size, elements_between)))

    @property
    def coarser(self) -> Mesh | None:
        """Elements twice as long between the same named nodes; None where some have no two elements between them."""
        if any(place % 2 for place in self.named):
            return None
        return Mesh(self.positions[::2], tuple(place // 2 for place in self.named))

    @property
    def degrees(self) -> int:
        """Number of degrees of freedom N."""
        return len(DIRECTIONS) * self.positions.size

    def degree(self, dof: Dof) -> int:
        """Row of `dof` in the matrices of the beam.

        Raises:
            AnalysisError: the mesh has no such node.
        """
        return int(self.node_degrees(dof.node)[DIRECTIONS.index(dof.direction)])

    def node_degrees(self, node: int) -> NDArray[np.intp]:
        """(3,) rows of x, y and rotation at `node`, numbered from 1.

        Raises:
            AnalysisError: the mesh has no such node.
        """
        if not 1 <= node <= len(self.named):
            raise AnalysisError(f"there is no node {node}; the beam has nodes 1 to {len(self.named)}")
        return len(DIRECTIONS) * self.named[node - 1] + np.arange(len(DIRECTIONS))


@dataclass(frozen=True, eq=False)
class FreeBeam:
    """The beam without its joints: Z(lambda) = lambda^2 M + lambda C + K of Eq. (39), whole and in free modes.

    Attributes:
        mass, damping, stiffness: (N, N) M, C and K, three freedoms to a node (x, y, rotation).
        squared_frequency: (N,) w_r^2 of the undamped free modes, rad^2/s^2, rising, three of them zero.
        damping_rate: (N,) 2 zeta_r w_r, 1/s.
        shapes: (N, N) mass-normalised free modes in columns.
    """

    beam: Beam
    theory: Theory
    mesh: Mesh
    mass: Real
    damping: Real
    stiffness: Real
    squared_frequency: Real
    damping_rate: Real
    shapes: Real

    @property
    def frequency(self) -> Real:
        """(N,) natural frequencies of the free beam in Hz; the first three are rigid motions at zero."""
        return np.asarray(np.sqrt(self.squared_frequency) / (2 * np.pi))

    def dynamic_stiffness(self, pole: complex) -> Complex:
        """(N, N) Z at one complex frequency lambda, rad/s, Eq. (39)."""
        return np.asarray(pole**2 * self.mass + pole * self.damping + self.stiffness, dtype=complex)

    def modal_stiffness(self, poles: Complex) -> Complex:
        """(..., N) the diagonal that Z(lambda) is in free modes, for lambda of any shape (...), rad/s."""
        lam = np.asarray(poles, dtype=complex)[..., None]
        return np.asarray(lam**2 + lam * self.damping_rate + self.squared_frequency)

    def receptance(self, poles: Complex, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Complex:
        """(..., rows, columns) of Z(lambda)^-1, m/N, for lambda of any shape (...), rad/s."""
        return self._modal_sum(1 / self.modal_stiffness(poles), rows, columns)

    def receptance_slope(self, poles: Complex, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Complex:
        """(..., rows, columns) derivative of `receptance` in lambda, m s/N."""
        rate = 2 * np.asarray(poles, dtype=complex)[..., None] + self.damping_rate
        return self._modal_sum(-rate / self.modal_stiffness(poles) ** 2, rows, columns)

    def with_material(self, modulus: float, density: float) -> FreeBeam:
        """The beam with `modulus` times the stiffness and `density` times the mass; each mode keeps its damping ratio.

        Known point masses share the factor of the density.
        """
        return replace(
            self,
            beam=replace(
                self.beam, youngs_modulus=modulus * self.beam.youngs_modulus, density=density * self.beam.density
            ),
            mass=density * self.mass,
            damping=np.sqrt(modulus * density) * self.damping,
            stiffness=modulus * self.stiffness,
            squared_frequency=modulus / density * self.squared_frequency,
            damping_rate=np.sqrt(modulus / density) * self.damping_rate,
            shapes=self.shapes / np.sqrt(density),
        )

    def _modal_sum(self, weight: Complex, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Complex:
        return np.asarray((self.shapes[rows] * weight[..., None, :]) @ self.shapes[columns].T)


def assemble(
    beam: Beam,
    mesh: Mesh,
    theory: Theory = Theory.TIMOSHENKO,
    damping_ratios: Sequence[float] = (),
    point_masses: Mapping[int, float] | None = None,
) -> FreeBeam:
    """Matrices and free modes of `beam` on `mesh`, Eqs. (1)-(7).

    Args:
        beam: geometry and material.
        mesh: nodes; the first lies at 0 and the last at the beam's length.
        theory: Timoshenko, or Euler-Bernoulli (phi = 0 and no rotary inertia: this gives the paper's Table 1).
        damping_ratios: zeta of the elastic free modes from the lowest up; the last holds for those above, where
            beams lose about alike. Where none is given, there is no damping.
        point_masses: known masses in kg by node, such as metal caps of a joint or an accelerometer.

    Raises:
        AnalysisError: the mesh does not span the beam, a damping ratio or mass is negative, a node is unknown.
    """
    check_span(beam.length, float(mesh.positions[0]), float(mesh.positions[-1]))
    mass, stiffness = _matrices(beam, mesh, theory)
    for node, kilograms in (point_masses or {}).items():
        if not (np.isfinite(kilograms) and kilograms >= 0):
            raise AnalysisError(f"the point mass at node {node} is {kilograms} kg; it must not be negative")
        x, y, _ = mesh.node_degrees(node)
        mass[x, x] += kilograms
        mass[y, y] += kilograms

    squared_frequency, shapes = _free_modes(mass, stiffness)
    rate = np.zeros(mesh.degrees)
    ratios = np.asarray(damping_ratios, dtype=float)
    check_damping(ratios.tolist(), rate.size)
    if ratios.size:
        ratios = np.pad(ratios, (0, rate.size - RIGID_MODES - ratios.size), mode="edge")
        rate[RIGID_MODES:] = 2 * ratios * np.sqrt(squared_frequency[RIGID_MODES:])
    weighted = mass @ shapes
    return FreeBeam(
        beam=beam,
        theory=theory,
        mesh=mesh,
        mass=mass,
        damping=np.asarray((weighted * rate) @ weighted.T),
        stiffness=stiffness,
        squared_frequency=squared_frequency,
        damping_rate=rate,
        shapes=shapes,
    )


def _matrices(beam: Beam, mesh: Mesh, theory: Theory) -> tuple[Real, Real]:
    """(N, N) mass and stiffness, element by element."""
    mass = np.zeros((mesh.degrees, mesh.degrees))
    stiffness = np.zeros_like(mass)
    mass_per_length = beam.density * beam.area
    for number, (start, end) in enumerate(pairwise(mesh.positions)):
        length = float(end - start)
        shear = theory is Theory.TIMOSHENKO
        phi = beam.shear_flexibility(length) if shear else 0.0
        first = len(DIRECTIONS) * number
        rod = np.ix_(*(2 * [[first + place for place in element.ROD]]))
        bending = np.ix_(*(2 * [[first + place for place in element.BENDING]]))
        stiffness[rod] += element.rod_stiffness(beam.youngs_modulus * beam.area, length)
        mass[rod] += element.rod_mass(mass_per_length, length)
        stiffness[bending] += element.bending_stiffness(beam.flexural_rigidity, length, phi)
        mass[bending] += element.translational_mass(mass_per_length, length, phi)
        if shear:
            mass[bending] += element.rotary_mass(beam.density * beam.second_moment, length, phi)
    return mass, stiffness


def _free_modes(mass: Real, stiffness: Real) -> tuple[Real, Real]:
    """Squared frequencies (N,) rising and mass-normalised shapes (N, N) of the undamped free beam.

    Solved for 1 / (w^2 + shift): rounding then falls on the highest modes, which hardly matter, and
    not on the lowest, ten orders of magnitude below them.
    """
    inverse, shapes = eigh(mass, stiffness + SHIFT * mass)
    inverse, shapes = inverse[::-1], shapes[:, ::-1]
    squared = 1 / inverse - SHIFT
    squared[:RIGID_MODES] = 0.0
    return squared, np.asarray(shapes / np.sqrt(inverse))
