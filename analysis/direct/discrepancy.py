"""What a specimen does beyond its law: a smooth discrepancy over amplitude and frequency.

No specimen follows a law of ten parameters to the error of its points, and 120 points at three amplitudes say three
things about amplitude, not 120. So what the specimen does is the law times e^d, and the real part of d (of ln |k_d|)
and its imaginary part (of the loss angle) are taken for Gaussian processes over the logarithms of amplitude and
frequency (M. C. Kennedy and A. O'Hagan, J. Royal Statistical Society B 63, 2001, 425-464): one over amplitude alone,
the same at every frequency, and one over both. Their covariance is Matern's of order 3/2: smooth, but not so smooth
that it could be extrapolated. At measured points d is known from them; a factor of e away it is not known any more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex, Real

REACH = 1.0  # of the logarithms of amplitude and frequency, over which discrepancies resemble each other
PRIOR_MEDIANS = np.array([[0.03, 0.01], [0.01, 0.005]])
"""Standard deviations of ln |k_d| and of the loss angle in rad, over amplitude alone and over both, before looking:
laws of filled rubber are good to some per cent in stiffness and to a tenth in loss."""
PRIOR_FACTOR = 2.0  # one standard deviation of their logarithms


@dataclass(frozen=True, eq=False)
class OperatingPoints:
    """Where a specimen is asked: amplitudes (points,) zero to peak in m, frequencies (points,) in Hz."""

    amplitude: Real
    frequency: Real

    def resemblance(self, other: OperatingPoints) -> Real:
        """(2, points, other points) correlation of the discrepancies over amplitude alone and over both."""
        by_amplitude = np.log(self.amplitude[:, None] / other.amplitude)
        by_frequency = np.log(self.frequency[:, None] / other.frequency)
        scaled = np.sqrt(3) / REACH * np.stack([np.abs(by_amplitude), np.hypot(by_amplitude, by_frequency)])
        return np.asarray((1 + scaled) * np.exp(-scaled))


def covariance(resemblance: Real, deviations: Real) -> Real:
    """(2 points, 2 other points) of the discrepancies of ln |k_d| and loss angle, point by point.

    Args:
        resemblance: (2, points, other points).
        deviations: (2, 2) standard deviations of ln |k_d| and of the loss angle, for each resemblance.
    """
    _, points, other_points = resemblance.shape
    found = np.zeros((2 * points, 2 * other_points))
    for part in range(2):
        found[part::2, part::2] = np.tensordot(np.square(deviations[:, part]), resemblance, axes=1)
    return found


def log_prior(deviations: Real) -> float:
    """Logarithm of the prior of the (2, 2) standard deviations, up to a constant."""
    return float(-0.5 * np.sum((np.log(deviations / PRIOR_MEDIANS) / np.log(PRIOR_FACTOR)) ** 2))


def interleaved(values: Complex) -> Real:
    """(2 points, ...) real and imaginary parts of (points, ...) in turn."""
    parts = np.stack([values.real, values.imag], axis=1)
    return np.asarray(parts.reshape(-1, *values.shape[1:]))
