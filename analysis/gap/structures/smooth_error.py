"""Smooth relative errors of measured curves, of sensors or of the simulation, which are no effect and no noise.

The error of a curve y is y e, where e is a sum of half waves over the values of the curve in their order, with Gaussian
coefficients (complex ones for complex values) and the root mean square `scale`. It is marginalised: values and
predictions, over their deviations, are divided by the root of the covariance 1 + E E^t, where E are the columns of y e.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.structures.curve import Curve

HALF_NORMAL = 0.003
"""Scale of the half-normal prior of the scale, as for the beam rig; a gap is no reason for a larger scale."""
SCALES = tuple(HALF_NORMAL * each for each in (0.0, 0.1, 0.2, 0.35, 0.6, 1.0))
"""Scales that are tried."""
HALF_WAVES = 4
"""Largest number of half waves, 0, 1, 2 ... over a curve."""
LEAST_VALUES = 2
"""Values of a curve for each of its half waves, at least."""


@dataclass(frozen=True, eq=False)
class ErrorModes:
    """Smooth errors of one curve, of scale one.

    Attributes:
        shapes: (data, K) orthonormal, of whitened real and imaginary parts.
        power: (K,) variance along each.
    """

    shapes: Real
    power: Real

    def whitened(self, values: Real, scale: float) -> Real:
        """(..., data) values over the root of the covariance of noise and smooth errors."""
        if not scale or not self.power.size:
            return values
        along = values @ self.shapes
        return np.asarray(values - (along * (1 - 1 / np.sqrt(1 + scale**2 * self.power))) @ self.shapes.T)

    def log_determinant(self, scale: float) -> float:
        """Of the covariance, over that of noise alone."""
        return float(np.sum(np.log1p(scale**2 * self.power)))


@lru_cache(maxsize=4096)
def error_modes(curve: Curve, inflation: float = 0.0) -> ErrorModes:
    """Smooth errors of the values that count, where deviations are inflated by a share of each value."""
    errors = error_shapes(curve) / inflated(curve, inflation)
    columns = _columns(errors, curve.counted, curve.is_complex)
    shapes, values, _ = np.linalg.svd(columns.T, full_matrices=False)
    return ErrorModes(shapes, values**2)


def error_shapes(curve: Curve) -> Complex | Real:
    """(k, n) smooth errors of a curve, of which the sum of squares is about the square of each value."""
    count = curve.values.size
    orders = np.arange(min(HALF_WAVES, count // LEAST_VALUES))
    waves = np.cos(np.outer(orders, np.linspace(0.0, np.pi, count)))
    size = np.sqrt(np.mean(np.sum(waves**2, axis=0))) if orders.size else 1.0
    return np.asarray(waves / size * curve.values)


def inflated(curve: Curve, inflation: float) -> Real:
    """(n,) deviations, inflated by a share of each value."""
    return np.hypot(curve.deviation, inflation * np.abs(curve.values))


def _columns(errors: Complex | Real, kept: np.ndarray, is_complex: bool) -> Real:
    """(K, data) of errors (k, n); complex values have one in phase and one a quarter of a turn ahead."""
    own = errors[:, kept]
    if not is_complex:
        return np.asarray(own.real)
    return np.concatenate([np.concatenate([each.real, each.imag], axis=1) for each in (own, 1j * own)])
