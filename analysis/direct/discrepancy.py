"""How a specimen deviates from its law: a smooth discrepancy over amplitude and frequency.

No specimen follows a law of ten parameters to the error of its points, and 120 points at three amplitudes hold three
pieces of information about amplitude, not 120. So the stiffness is the law times e^d. The real part of d (of ln |k_d|)
and its imaginary part (of the loss angle) are taken as Gaussian processes over the logarithms of amplitude and
frequency (M. C. Kennedy and A. O'Hagan, J. Royal Statistical Society B 63, 2001, 425-464): one over amplitude alone,
the same at every frequency, and one over both. Their covariance is Matern's of order 3/2: smooth, but not smooth enough
for extrapolation. At measured points d is known from them; a factor of e away it is nearly unknown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex, Real

REACH = 1.0  # length of correlation, in the logarithms of amplitude and frequency
PRIOR_MEDIANS = np.array([[0.03, 0.01], [0.01, 0.005]])
"""Prior standard deviations of ln |k_d| and of the loss angle in rad, over amplitude alone and over both: laws of
filled rubber hold to some per cent in stiffness and to a tenth in loss."""
PRIOR_FACTORS = np.array([[2.0], [10.0]])
"""One standard deviation of their logarithms. Three amplitudes tell next to nothing of the first, many frequencies the
second, which may be far smaller than in filled rubbers."""


@dataclass(frozen=True, eq=False)
class OperatingPoints:
    """Amplitudes (points,) zero to peak in m and frequencies (points,) in Hz of measurements or predictions.

    `linear`: the specimen does not depend on amplitude, and neither does its discrepancy.
    """

    amplitude: Real
    frequency: Real
    linear: bool = False

    def correlation(self, other: OperatingPoints) -> Real:
        """(2, points, other points) correlation of the discrepancies over amplitude alone and over both."""
        by_amplitude = np.log(self.amplitude[:, None] / other.amplitude) * (not self.linear)
        by_frequency = np.log(self.frequency[:, None] / other.frequency)
        scaled = np.sqrt(3) / REACH * np.stack([np.abs(by_amplitude), np.hypot(by_amplitude, by_frequency)])
        return np.asarray((1 + scaled) * np.exp(-scaled))


def covariance(correlation: Real, deviations: Real) -> Real:
    """(2 points, 2 other points) of the discrepancies of ln |k_d| and loss angle, point by point.

    Args:
        correlation: (2, points, other points).
        deviations: (2, 2) standard deviations of ln |k_d| and of the loss angle, for each correlation.
    """
    _, points, other_points = correlation.shape
    found = np.zeros((2 * points, 2 * other_points))
    for part in range(2):
        found[part::2, part::2] = np.tensordot(np.square(deviations[:, part]), correlation, axes=1)
    return found


def log_prior(deviations: Real) -> float:
    """Logarithm of the prior of the (2, 2) standard deviations, up to a constant."""
    return float(-0.5 * np.sum((np.log(deviations / PRIOR_MEDIANS) / np.log(PRIOR_FACTORS)) ** 2))


def interleaved(values: Complex) -> Real:
    """(2 points, ...) real and imaginary parts of (points, ...) in turn."""
    parts = np.stack([values.real, values.imag], axis=1)
    return np.asarray(parts.reshape(-1, *values.shape[1:]))
