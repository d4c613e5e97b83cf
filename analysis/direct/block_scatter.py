"""How well a mean over blocks of whole cycles is known, for a machine whose amplitude wanders gradually.

Batch means (Schmeiser, Operations Research 30, 1982, 556-568) take blocks for independent. Blocks of a cycle or two are
not: an amplitude does not jump, so what is left of one cycle's deviation is found in the next. A process that forgets
after one cycle can have neighbours correlated by 1/2 at the most, as a straight run from one cycle's value to the
next one's has; the variance of the mean is then twice what independent cycles would give. Ten cycles cannot tell that
from none, so 1/2 is assumed of wander, and more of longer blocks where more is measured.

Only what follows the amplitude wanders with it. The rest, the sensors' noise, scatters independently.
"""

from __future__ import annotations

import numpy as np

from analysis.frequency_response import Complex, Real

LARGEST_CORRELATION = 0.5  # of neighbours in a series that forgets after one step
FEWEST_TO_SPLIT = 5  # blocks; with fewer a regression on amplitude explains everything


def covariance_of_mean(deviation: Complex, amplitude: Real, cycles_per_block: int) -> Real:
    """(2, 2) covariance of the real and imaginary part of the mean of `deviation`.

    Args:
        deviation: (blocks,) what each block deviates by, two blocks or more; any unit.
        amplitude: (blocks,) of the motion in each, any unit.
        cycles_per_block: whole cycles in a block.
    """
    count = len(deviation)
    left = np.stack([deviation.real, deviation.imag])
    left = left - np.mean(left, axis=1, keepdims=True)
    wander = amplitude - np.mean(amplitude)
    square = float(wander @ wander)
    if count < FEWEST_TO_SPLIT or square == 0:
        # taken as wander, all of it
        return np.asarray(left @ left.T) * _inflation(LARGEST_CORRELATION / (2 * cycles_per_block - 1), count)
    slope = left @ wander / square
    left = left - np.outer(slope, wander)
    shared = variance_of_mean(amplitude, cycles_per_block)
    # of the slope's square, what its own error adds is taken off again: 1 / square of what is left
    independent = left @ left.T / (count - 2) * (1 / count - shared / square)
    return np.asarray(independent + np.outer(slope, slope) * shared)


def variance_of_mean(series: Real, cycles_per_block: int) -> float:
    """Variance of the mean of what wanders gradually, from its values (blocks,), two blocks or more."""
    count = len(series)
    left = series - np.mean(series)
    square = float(left @ left)
    if square == 0:
        return 0.0
    # neighbours of a short series are biased towards disagreeing by 1 / count
    measured = float(left[1:] @ left[:-1]) / square + 1 / count
    at_least = LARGEST_CORRELATION / (2 * cycles_per_block - 1)
    return square * _inflation(min(max(at_least, measured), LARGEST_CORRELATION), count)


def _inflation(correlation: float, count: int) -> float:
    """From the sum of squares to the variance of the mean of `count` values whose neighbours are correlated."""
    return (1 + 2 * correlation) / (count * (count - 1))
