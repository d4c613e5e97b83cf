"""The free beam: its mode shapes at any position, and modal stiffness for any modulus, density and damping."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from analysis.dof import Direction
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.gap.measurement import Drawing
from analysis.structure.beam import DIRECTIONS, FreeBeam, Mesh, assemble
from analysis.structure.setup import RIGID_MODES

ELEMENTS_BETWEEN_NODES = 8
DEGREE = 5
"""Degree of the splines through nodes of the mesh: smooth to the fourth derivative, as a free mode is."""


@dataclass(frozen=True, eq=False)
class BeamModes:
    """Modes of the beam without joints.

    Attributes:
        free: the beam as drawn, on its mesh.
        damping_rate: (N,) 2 zeta w of each mode, 1/s.
    """

    free: FreeBeam
    damping_rate: Real

    @cached_property
    def _splines(self) -> dict[Direction, tuple[BSpline, BSpline]]:
        found = {}
        for place, direction in enumerate(DIRECTIONS):
            spline = make_interp_spline(self.free.mesh.positions, self.free.shapes[place :: len(DIRECTIONS)], DEGREE)
            found[direction] = spline, spline.derivative()
        return found

    def motion(self, direction: Direction, position: float | Real) -> Real:
        """(..., N) the modes in `direction` at `position` (...,), m from the left end."""
        return np.asarray(self._splines[direction][0](position))

    def slope(self, direction: Direction, position: float | Real) -> Real:
        """(..., N) derivative of `motion` in the position, 1/m."""
        return np.asarray(self._splines[direction][1](position))

    @cached_property
    def mesh_share(self) -> Real:
        """(N,) error of a mesh in squared frequencies, over that of the third free mode.

        It grows in proportion to the squared frequency (cubic shapes: the inverse fourth power of the wavelength), up
        to ten times the third frequency.
        """
        square = self.free.squared_frequency
        return np.asarray(np.minimum(square / square[RIGID_MODES + 2], 100.0))

    @cached_property
    def angular_frequency(self) -> Real:
        """(N,) angular frequency of the modes, rad/s; zero for rigid modes."""
        found = np.sqrt(np.maximum(self.free.squared_frequency, 0.0))
        found[:RIGID_MODES] = 0.0
        return np.asarray(found)

    def modal_parts(self, modulus: float, density: float, mesh: float, rate: Real) -> tuple[Real, Real, Real]:
        """(N,) modal mass, viscous damping (1/s) and stiffness (1/s^2) of modes whose mass as drawn is one.

        Args:
            modulus, density: relative to the drawing. They scale the beam's stiffness and mass exactly, with the modal
                damping ratios kept.
            mesh: share by which the mesh raises the squared frequency of the third free mode.
            rate: (N,) 2 zeta w of each mode as drawn.
        """
        elastic = modulus * (1 + mesh * self.mesh_share) * self.free.squared_frequency
        return np.full(elastic.size, density), np.sqrt(modulus * density) * rate, elastic


def modal_stiffness(parts: Sequence[Real], pole: Complex, loss: Real | float) -> Complex:
    """(N, lines) dynamic stiffness of modes with these modal mass, damping and stiffness (N,), and a loss factor."""
    mass, damping, stiffness = (each[:, None] for each in parts)
    return np.asarray(mass * pole**2 + damping * pole + stiffness * (1 + 1j * np.asarray(loss)))


def beam_modes_of(drawing: Drawing, elements_between: int = ELEMENTS_BETWEEN_NODES) -> BeamModes:
    """The beam of a drawing.

    Raises:
        AnalysisError: the node positions do not span the beam, or a damping ratio is negative.
    """
    mesh = Mesh.through(drawing.node_positions, elements_between)
    free = assemble(drawing.beam, mesh)
    ratios = np.zeros(free.squared_frequency.size)
    given = np.asarray(drawing.damping_ratios, dtype=float)
    if np.any(given < 0):
        raise AnalysisError(f"damping ratios of the free beam are {given.tolist()}; none may be negative")
    if given.size:
        ratios[RIGID_MODES:] = given[-1]
        ratios[RIGID_MODES : RIGID_MODES + given.size] = given[: ratios.size - RIGID_MODES]
    return BeamModes(free, 2 * ratios * np.sqrt(free.squared_frequency))
