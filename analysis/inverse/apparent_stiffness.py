"""Where an apparent dynamic stiffness over frequency can be that of an elastomer, and why not elsewhere.

An inversion of measured responses gives a stiffness at every line, even where the number comes only from noise in a
poorly conditioned inversion, from inertia that was not subtracted, or from a resonance of the part that carries the
joint. A joint made of springs that relax has a stiffness with

- a positive storage part, as it pushes back,
- a loss part that is not negative, as it feeds no energy,
- a magnitude that rises at most in proportion to frequency, as a dashpot does; it never falls, and where the mass of
  the joint itself takes off half of it, k - w^2 m falls as f^-2.

Each is asked for within what is uncertain, the last over half an octave. References: J. D. Ferry, Viscoelastic
Properties of Polymers, 3rd ed., Chapter 1; ISO 10846-1 for the frequency up to which a mount is a spring.
"""

from dataclasses import dataclass
from enum import StrEnum
from itertools import groupby
from typing import NamedTuple

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real

WINDOW = 2**0.25
"""Ratio to a line of the farthest lines that show whether the stiffness rises or falls there: half an octave in all."""
STEEPEST_RISE, STEEPEST_FALL = 1.0, -2.0
"""d ln |z| / d ln f of a dashpot, and of a spring half of whose stiffness inertia takes off."""
NARROWEST, FEWEST_LINES = 2 ** (1 / 3), 5
"""Smallest ratio of the ends of a band, and fewest lines in it; a few lines may pass by chance."""
SIGNIFICANT = 2.0  # standard errors
ROUNDING = 1e-9


class Refusal(StrEnum):
    """Why lines cannot be the stiffness of a joint."""

    STORAGE = "storage"
    LOSS = "loss"
    RISE = "rise"
    FALL = "fall"
    NARROW = "narrow"


@dataclass(frozen=True)
class RefusedBand:
    """Neighbouring lines that cannot be the stiffness of a joint.

    Attributes:
        lowest, highest: Hz.
        refusal: the condition that they fail.
        worst: Hz, the line that fails it most; the lowest of a band that is too narrow.
        value: what is wrong there: the storage or the loss stiffness, or the exponent n of a stiffness that follows
            f^n; of a band that is too narrow, its number of lines.
    """

    lowest: float
    highest: float
    refusal: Refusal
    worst: float
    value: float


@dataclass(frozen=True, eq=False)
class StiffnessBands:
    """The bands in which an apparent stiffness can be that of a joint.

    Attributes:
        refused: all other bands, rising.
        accepted: (lines,) whether a line is in a band that can be a joint's.
    """

    refused: tuple[RefusedBand, ...]
    accepted: np.ndarray[tuple[int], np.dtype[np.bool_]]


def identifiable_bands(frequency: Real, stiffness: Complex, relative_error: float | Real) -> StiffnessBands:
    """Sort the lines of an apparent dynamic stiffness into bands that can be a joint's and bands that cannot.

    Args:
        frequency: (lines,) in Hz, positive and rising.
        stiffness: (lines,) complex, k + i h, in N/m or N m.
        relative_error: standard error of the real and of the imaginary part over the magnitude, for all lines or
            (lines,).

    Raises:
        AnalysisError: shapes differ, frequencies do not rise from above zero, or a number is not finite.
    """
    error = np.broadcast_to(np.asarray(relative_error, dtype=np.float64), frequency.shape)
    if frequency.ndim != 1 or frequency.size == 0 or stiffness.shape != frequency.shape:
        raise AnalysisError(
            f"frequency has shape {frequency.shape} and stiffness {stiffness.shape}; give (lines,) each"
        )
    if not (frequency[0] > 0 and np.all(np.diff(frequency) > 0)):
        raise AnalysisError("frequencies of an apparent stiffness have to rise, from above zero")
    if not (np.all(np.isfinite(stiffness)) and np.all(np.isfinite(error)) and np.all(error >= 0)):
        raise AnalysisError("an apparent stiffness or its error holds values that are no finite numbers")
    failed = [_failed(frequency, stiffness, error, line) for line in range(frequency.size)]
    refused = list[RefusedBand]()
    accepted = np.zeros(frequency.size, dtype=bool)
    for refusal, group in groupby(range(frequency.size), key=lambda line: failed[line].refusal):
        lines = list(group)
        lowest, highest = float(frequency[lines[0]]), float(frequency[lines[-1]])
        if refusal is not None:
            worst = max(lines, key=lambda line: failed[line].by)
            refused.append(RefusedBand(lowest, highest, refusal, float(frequency[worst]), failed[worst].value))
        elif highest < NARROWEST * lowest or len(lines) < FEWEST_LINES:
            refused.append(RefusedBand(lowest, highest, Refusal.NARROW, lowest, len(lines)))
        else:
            accepted[lines] = True
    return StiffnessBands(tuple(refused), accepted)


class _Failed(NamedTuple):
    """The condition that a line fails, None for none; by how much; and the value that fails it."""

    refusal: Refusal | None
    by: float
    value: float


def _failed(frequency: Real, stiffness: Complex, error: Real, line: int) -> _Failed:
    z, margin = complex(stiffness[line]), SIGNIFICANT * float(error[line]) + ROUNDING
    size = abs(z)
    if z.real <= margin * size:
        return _Failed(Refusal.STORAGE, 1 - z.real / size if size else 2.0, z.real)
    if z.imag < -margin * size:
        return _Failed(Refusal.LOSS, -z.imag / size, z.imag)
    slope, slope_error = _slope(frequency, stiffness, error, line)
    if slope - SIGNIFICANT * slope_error > STEEPEST_RISE + ROUNDING:
        return _Failed(Refusal.RISE, slope, slope)
    if slope + SIGNIFICANT * slope_error < STEEPEST_FALL:
        return _Failed(Refusal.FALL, -slope, slope)
    return _Failed(None, 0.0, 0.0)


def _slope(frequency: Real, stiffness: Complex, error: Real, line: int) -> tuple[float, float]:
    """D ln |z| / d ln f about a line, with its standard error; zero with an infinite one where no other is near."""
    near = (frequency <= WINDOW * frequency[line]) & (frequency >= frequency[line] / WINDOW) & (stiffness != 0)
    if np.count_nonzero(near) < 2:
        return 0.0, np.inf
    x, y = np.log(frequency[near]), np.log(np.abs(stiffness[near]))
    lever = x - np.mean(x)
    weight = lever / np.sum(lever**2)
    return float(weight @ y), float(np.linalg.norm(weight * error[near]))
