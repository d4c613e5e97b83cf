"""What the springs of a suspension add to the elastic modes of the bar that hangs in them.

Springs of stiffness k_j at x_j leave the shape psi_r of an elastic mode as it is, to first order (Rayleigh), so with
mass-normalised shapes, m the mass that hangs and f_s the frequency of its bounce, (2 pi f_s)^2 = sum k_j / m,

    f_r^2 = f_r,free^2 + f_s^2 a_r,      zeta_r f_r = zeta_r,free f_r,free + eta_s f_s^2 a_r / (2 f_r),

where a_r is the mean of m psi_r^2 over the springs: 4 at the ends of a slender bar, 0 at the nodes of the mode, and 1
on average over the bar. The bar's own damping is viscous, zeta f then stays; that of the springs is structural. What
is left out of f_r is below 8 (f_s / f_r)^4 of it, where springs at the ends couple it to the rigid modes: 2e-6 for
springs of 5 Hz under the first mode of a bar of 160 Hz, which couples to the bounce only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from analysis.dof import Direction
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.structure.beam import DIRECTIONS, FreeBeam

SOFT = 0.1  # a suspension above this share of the first elastic frequency is stiff


@dataclass(frozen=True)
class Suspension:
    """Equal springs, or cords, that hold the bar against motion in the plane in which it bends.

    Attributes:
        frequency: of the bounce of the hanging bar in that plane, Hz.
        standard_error: of that frequency, Hz.
        positions: where the springs are along the bar, m from its left end; empty where that is not known.
        loss_factor: of the springs.

    Raises:
        AnalysisError: the frequency is not positive, or the error or the loss factor is negative.
    """

    frequency: float
    standard_error: float = 0.0
    positions: tuple[float, ...] = ()
    loss_factor: float = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.frequency) and self.frequency > 0):
            raise AnalysisError(f"the suspension's frequency is {self.frequency} Hz; it must be a positive number")
        for name in ("standard_error", "loss_factor"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise AnalysisError(f"the suspension's {name} is {getattr(self, name)}; it must not be negative")


@dataclass(frozen=True, eq=False)
class Participation:
    """How much some elastic modes move at the springs.

    Attributes:
        mean: (modes,) a_r, the mean of m psi_r^2.
        deviation: (modes,) its standard deviation: nought where the springs' places are known, otherwise that of one
            spring anywhere on the bar.
    """

    mean: Real
    deviation: Real


def participation(suspension: Suspension, free_beam: FreeBeam, places: Sequence[int]) -> Participation:
    """a_r of the elastic modes at `places` among the modes of `free_beam`.

    Raises:
        AnalysisError: a spring is not on the bar.
    """
    across = DIRECTIONS.index(Direction.Y)
    positions = free_beam.mesh.positions
    hanging = float(np.sum(free_beam.mass[across :: len(DIRECTIONS), across :: len(DIRECTIONS)]))
    shape = CubicSpline(positions, free_beam.shapes[across :: len(DIRECTIONS), list(places)])
    off = [place for place in suspension.positions if not positions[0] <= place <= positions[-1]]
    if off:
        raise AnalysisError(f"no spring can be at {off} m; the bar reaches from {positions[0]} to {positions[-1]} m")
    if suspension.positions:
        mean = hanging * np.mean(shape(suspension.positions) ** 2, axis=0)
        return Participation(mean, np.zeros_like(mean))
    anywhere = hanging * shape(np.linspace(positions[0], positions[-1], 10 * positions.size)) ** 2
    return Participation(np.mean(anywhere, axis=0), np.std(anywhere, axis=0))
