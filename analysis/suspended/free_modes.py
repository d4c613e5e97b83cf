"""Elastic modes of a suspended beam: found among the measured modes, without the effect of the suspension.

Springs of stiffness k_j at x_j do not change the shape psi_r of an elastic mode to first order (Rayleigh). With
mass-normalised shapes, m the suspended mass and f_s the frequency of its bounce, (2 pi f_s)^2 = sum k_j / m,

    f_r^2 = f_r,free^2 + f_s^2 a_r,      zeta_r f_r = zeta_r,free f_r,free + eta_s f_s^2 a_r / (2 f_r),

where a_r is the mean of m psi_r^2 over the springs: 4 at the ends of a slender beam, 0 at the nodes of the mode, and 1
on average over the beam. The beam's own damping is viscous, so zeta f stays; that of the springs is structural. The
error of f_r is below 8 (f_s / f_r)^4 of it, from springs at the ends that couple it to the rigid modes: 2e-6 for
springs of 5 Hz under the first mode of a beam of 160 Hz, which couples to the bounce only.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import block_diag
from scipy.optimize import linear_sum_assignment

from analysis.dof import Direction
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.interval import Estimate
from analysis.modes import Modes
from analysis.structure.agreement import mac
from analysis.structure.beam import DIRECTIONS, FreeBeam
from analysis.structure.setup import RIGID_MODES

SOFT = 0.1  # a suspension above this share of the first elastic frequency is stiff
NEAR = 0.1  # largest difference in the logarithm of frequency between a measured mode and its prediction
ALIKE = 0.8  # least modal assurance criterion between them
_NO_PAIR = 1e3  # cost of a pair that does not match: more than all true pairs together


@dataclass(frozen=True)
class BeamSuspension:
    """Equal springs or cords that suspend the beam; they act in the plane of bending.

    Attributes:
        frequency: of the bounce of the suspended beam in that plane, Hz.
        standard_error: of that frequency, Hz.
        positions: of the springs along the beam, m from its left end; empty where unknown.
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
    """Motion of elastic modes at the springs.

    Attributes:
        mean: (modes,) a_r, the mean of m psi_r^2.
        deviation: (modes,) its standard deviation: zero where the positions of the springs are known, otherwise that
            of one spring anywhere on the beam.
    """

    mean: Real
    deviation: Real


def participation(suspension: BeamSuspension, free_beam: FreeBeam, places: Sequence[int]) -> Participation:
    """a_r of the modes of `free_beam` with indices `places`.

    Raises:
        AnalysisError: a spring is not on the beam.
    """
    across = DIRECTIONS.index(Direction.Y)
    positions = free_beam.mesh.positions
    hanging = float(np.sum(free_beam.mass[across :: len(DIRECTIONS), across :: len(DIRECTIONS)]))
    shape = CubicSpline(positions, free_beam.shapes[across :: len(DIRECTIONS), list(places)])
    off = [place for place in suspension.positions if not positions[0] <= place <= positions[-1]]
    if off:
        raise AnalysisError(f"no spring can be at {off} m; the beam reaches from {positions[0]} to {positions[-1]} m")
    if suspension.positions:
        mean = hanging * np.mean(shape(suspension.positions) ** 2, axis=0)
        return Participation(mean, np.zeros_like(mean))
    anywhere = hanging * shape(np.linspace(positions[0], positions[-1], 10 * positions.size)) ** 2
    return Participation(np.mean(anywhere, axis=0), np.std(anywhere, axis=0))


@dataclass(frozen=True, eq=False)
class ElasticModes:
    """Elastic modes of the free beam from a test in which it was suspended.

    Attributes:
        numbers: (modes,) r as in the paper, the rigid modes being 1 to 3; rising.
        frequency: (modes,) undamped natural frequency of the free beam, Hz.
        damping_ratio: (modes,) viscous, of the free beam.
        covariance: (2 modes, 2 modes) of [f_4, zeta_4, f_5, ...] in Hz and 1, with the error of the suspension.
        suspension_shift: (modes,) rise of the measured frequency by the suspension, Hz; already subtracted.
        suspension_modes: frequencies of the measured modes below the limit, Hz; not used.
        others: frequencies of measured modes that match no elastic mode of this beam in its plane, Hz; not used.
    """

    numbers: tuple[int, ...]
    frequency: Real
    damping_ratio: Real
    covariance: Real
    suspension_shift: Real
    suspension_modes: tuple[float, ...]
    others: tuple[float, ...]

    @property
    def frequency_covariance(self) -> Real:
        """(modes, modes) Hz^2."""
        return self.covariance[::2, ::2]

    @property
    def damping_covariance(self) -> Real:
        """(modes, modes) of the damping ratios."""
        return self.covariance[1::2, 1::2]

    @property
    def angular_frequency(self) -> Real:
        """(modes,) w_r, rad/s."""
        return 2 * np.pi * self.frequency

    def frequency_estimate(self, number: int) -> Estimate | None:
        """Frequency of mode r = `number` in Hz, None where it was not measured."""
        return self._estimate(number, self.frequency, self.frequency_covariance)

    def damping_estimate(self, number: int) -> Estimate | None:
        """Damping ratio of mode r = `number`, None where it was not measured."""
        return self._estimate(number, self.damping_ratio, self.damping_covariance)

    def _estimate(self, number: int, values: Real, covariance: Real) -> Estimate | None:
        if number not in self.numbers:
            return None
        place = self.numbers.index(number)
        return Estimate(float(values[place]), float(np.sqrt(covariance[place, place])))


def elastic_modes(
    modes: Modes, free_beam: FreeBeam, lowest_frequency: float | None = None, suspension: BeamSuspension | None = None
) -> ElasticModes:
    """Find the elastic modes of the beam among measured ones, and subtract the effect of the suspension.

    A measured mode matches a predicted one within 10 % in frequency and with a modal assurance criterion of 0.8 or
    more. Where several match, as many modes as possible are paired.

    Args:
        modes: of the suspended beam, with the covariance of the poles.
        free_beam: the beam as drawn with the masses mounted on it, on a mesh that has the measured nodes.
        lowest_frequency: modes below it, Hz, are those of the suspension; half of the first elastic mode by default.
        suspension: of the beam; None to subtract nothing.

    Raises:
        AnalysisError: the poles have no covariance, no mode is an elastic one, a node is unknown, or the suspension
            bounces above the limit.
    """
    if modes.pole_covariance is None:
        raise AnalysisError("the measured modes have no covariance; the test of the beam needs one")
    limit = 0.5 * float(free_beam.frequency[RIGID_MODES]) if lowest_frequency is None else lowest_frequency
    if suspension is not None and suspension.frequency >= limit:
        raise AnalysisError(
            f"the suspension bounces at {suspension.frequency:g} Hz, not below the limit of {limit:g} Hz between its "
            "modes and the elastic ones; use softer springs or lower the limit"
        )
    natural, covariance = _natural(modes)
    above = np.flatnonzero(natural[:, 0] >= limit)
    paired, places = _pairs(modes, free_beam, above)
    if paired.size == 0:
        raise AnalysisError(
            f"none of the modes at {natural[:, 0].round(2).tolist()} Hz is within {NEAR:.0%} of an elastic mode of the "
            f"beam, which has them at {free_beam.frequency[RIGID_MODES : RIGID_MODES + 3].round(1).tolist()} Hz, ...; "
            "check its dimensions and the nodes that were struck"
        )
    kept = np.stack([2 * paired, 2 * paired + 1], axis=1).ravel()
    values, covariance = natural[paired], covariance[np.ix_(kept, kept)]
    freed, covariance = _without_suspension(values, covariance, free_beam, places.tolist(), suspension)
    return ElasticModes(
        numbers=tuple(1 + place for place in places.tolist()),
        frequency=freed[:, 0],
        damping_ratio=freed[:, 1],
        covariance=covariance,
        suspension_shift=values[:, 0] - freed[:, 0],
        suspension_modes=tuple(natural[natural[:, 0] < limit, 0].tolist()),
        others=tuple(natural[np.setdiff1d(above, paired), 0].tolist()),
    )


def _natural(modes: Modes) -> tuple[Real, Real]:
    """(modes, 2) undamped frequencies |lambda| / 2 pi in Hz and damping ratios; covariance of [f, zeta, f, zeta, ...].

    With lambda = i w sqrt(1 + i eta): |lambda| = w (1 + eta^2)^(1/4) and zeta = sin(arctan(eta) / 2).
    """
    angle = np.arctan(modes.loss_factor) / 2
    stretch = (1 + modes.loss_factor**2) ** 0.25
    slope = block_diag(
        *(
            [[s, f * eta / (2 * s**3)], [0.0, np.cos(a) / (2 * s**4)]]
            for f, eta, s, a in zip(modes.frequency, modes.loss_factor, stretch, angle, strict=True)
        )
    )
    return np.stack([modes.frequency * stretch, np.sin(angle)], axis=1), slope @ modes.pole_covariance @ slope.T


def _pairs(
    modes: Modes, free_beam: FreeBeam, candidates: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Measured modes and places of their predictions, by rising frequency."""
    shapes = free_beam.shapes[[free_beam.mesh.degree(dof) for dof in modes.dofs]]
    moving = np.max(np.abs(shapes), axis=0) > 1e-6 * np.max(np.abs(shapes))
    elastic = np.flatnonzero(moving & (np.arange(moving.size) >= RIGID_MODES))
    distance = np.abs(np.log(free_beam.frequency[elastic] / modes.frequency[candidates, None]))
    assurance = mac(modes.shapes[candidates], shapes[:, elastic].T.astype(complex))
    cost = np.where((distance <= NEAR) & (assurance >= ALIKE), 1 - assurance + distance / NEAR, _NO_PAIR)
    rows, columns = linear_sum_assignment(cost)
    true = cost[rows, columns] < _NO_PAIR
    rows, columns = rows[true], columns[true]
    rising = np.argsort(elastic[columns])
    rows, columns = rows[rising], columns[rising]
    return candidates[rows], elastic[columns]


def _without_suspension(
    measured: Real, covariance: Real, free_beam: FreeBeam, places: list[int], suspension: BeamSuspension | None
) -> tuple[Real, Real]:
    """(modes, 2) frequencies and damping ratios of the free beam, and their covariance."""
    if suspension is None:
        return measured, covariance
    part = participation(suspension, free_beam, places)
    added = suspension.frequency**2 * part.mean
    square = measured[:, 0] ** 2 - added
    if np.any(square <= 0):
        raise AnalysisError(f"a suspension of {suspension.frequency:g} Hz explains a whole mode; check its frequency")
    found, free = measured[:, 0], np.sqrt(square)
    ratio = (measured[:, 1] * found - suspension.loss_factor * added / (2 * found)) / free
    by_added = np.stack([-1 / (2 * free), (ratio / free - suspension.loss_factor / found) / (2 * free)], axis=1)
    own = np.stack([found / free, found / free], axis=1).ravel()
    together = (by_added * (2 * suspension.frequency * suspension.standard_error * part.mean)[:, None]).ravel()
    apart = by_added * (suspension.frequency**2 * part.deviation)[:, None]
    unknown = np.outer(together, together) + block_diag(*(np.outer(mode, mode) for mode in apart))
    return np.stack([free, ratio], axis=1), covariance * np.outer(own, own) + unknown
