"""Coherent error of accelerances: a relative error of each row that is smooth over frequency, in the likelihood.

The error of a row is H(f) e(f), H its accelerance, with a complex Gaussian process e of standard deviation s and
correlation exp(-(f - f')^2 / (2 l^2)) (C. E. Rasmussen, C. K. I. Williams, Gaussian Processes, 2006). Of a
whitened row the covariance is then I + s^2 B B^H, where B = H / noise times a few smooth functions. Eigenvectors of
B^H B, computed once for a length l, give every inner product under this covariance, and its determinant, for any s.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.measurement import HammerSet

SMALLEST = 1e-12
"""Eigenvalue, over the largest of a row, below which a smooth function does not count."""


@dataclass(frozen=True, eq=False)
class SmoothErrors:
    """Smooth errors of the rows of one hammer set, for one length of correlation.

    Attributes:
        turn: (rows, lines) by which a row is turned so that its accelerance is real.
        modes: (rows, lines, K) orthonormal shapes of a whitened and turned row.
        power: (rows, K) variance of each over that of the relative error.
    """

    turn: Complex
    modes: Real
    power: Real

    def along(self, row: int, values: Complex) -> Complex:
        """(n, K) amplitudes of a row's modes in whitened `values` (n, lines)."""
        turned = values * self.turn[row]
        parts = np.concatenate([turned.real, turned.imag]) @ self.modes[row]
        return np.asarray(parts[: len(turned)] + 1j * parts[len(turned) :])

    def share(self, row: int, scale: float) -> Real:
        """(K,) share of each amplitude's square that smooth errors of this scale explain, 0 to 1."""
        power = scale**2 * self.power[row]
        return np.asarray(power / (1 + power))

    def log_determinant(self, scale: float) -> float:
        """Of the covariance of all rows, in real and imaginary parts, over that of noise alone."""
        return float(2 * np.sum(np.log1p(scale**2 * self.power)))

    def whitened(self, row: int, values: Complex, scale: float) -> Complex:
        """(n, lines) `values`, whitened for noise, whitened for smooth errors too."""
        less = 1 - np.sqrt(1 - self.share(row, scale))
        return np.asarray(values - self.turn[row].conj() * ((self.along(row, values) * less) @ self.modes[row].T))


@lru_cache(maxsize=64)
def smooth_errors(each: HammerSet, correlation: float) -> SmoothErrors:
    """Smooth errors of a hammer set; kept, as every fit to it needs them.

    Args:
        each: the set.
        correlation: length l, Hz.
    """
    frequency = each.frequency
    knots = np.arange(frequency[0] - correlation, frequency[-1] + 2 * correlation, correlation)
    # Gaussians of width l / sqrt(2) at knots l apart make a process of length l; its variance ripples by 1 %
    basis = np.exp(-(((frequency[:, None] - knots) / correlation) ** 2))
    basis /= np.sqrt(np.sum(basis**2, axis=1))[:, None]
    size = np.abs(each.from_neighbours)
    found = [_modes(row[:, None] * basis) for row in size / each.deviation]
    most = max(power.size for _, power in found)
    modes = np.zeros((len(size), frequency.size, most))
    powers = np.zeros((len(size), most))
    for row, (shapes, power) in enumerate(found):
        modes[row, :, : power.size], powers[row, : power.size] = shapes, power
    turn = each.from_neighbours.conj() / np.where(size > 0, size, 1.0)
    return SmoothErrors(np.where(size > 0, turn, 1.0), modes, powers)


def _modes(weighted: Real) -> tuple[Real, Real]:
    """Left singular vectors and squared singular values of (lines, knots)."""
    lines, knots = weighted.shape
    if knots < lines:
        power, right = np.linalg.eigh(weighted.T @ weighted)
        kept = power > SMALLEST * max(power[-1], 1e-300)
        return weighted @ right[:, kept] / np.sqrt(power[kept]), power[kept]
    power, left = np.linalg.eigh(weighted @ weighted.T)
    kept = power > SMALLEST * max(power[-1], 1e-300)
    return left[:, kept], power[kept]
