"""Misfit that remains after a fit beyond noise, without knowledge of how large the noise is.

Noise differs from line to line; a misfit does not. The products of neighbouring whitened residuals therefore add up to
the energy of the misfit alone, and to nothing where the model holds (G. M. Ljung, G. E. P. Box, Biometrika 65, 1978).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.measurement import Indices, TesterPoints

CHANCE_LIMIT = 3.0
"""Standard deviations within which a misfit may be chance."""
LOUDEST = 2.0
"""Ratio up to which the true variance of noise may exceed the stated one."""


def series(points: TesterPoints) -> dict[tuple[int, int, int], Indices]:
    """Indices of the points of each specimen, configuration and amplitude, by rising frequency."""
    amplitudes = np.unique(np.round(points.amplitude, 9), return_inverse=True)[1]
    keys = np.stack([points.specimen, points.configuration, amplitudes], axis=1)
    found = {}
    for key in np.unique(keys, axis=0):
        members = np.flatnonzero(np.all(keys == key, axis=1))
        found[int(key[0]), int(key[1]), int(key[2])] = members[np.argsort(points.frequency[members], kind="stable")]
    return found


def energy_of(left: Complex | Real, decay: float = 0.0) -> tuple[float, float]:
    """Energy of the misfit in a whitened residual (n,) of neighbours, and its standard deviation without misfit.

    Products of neighbours at a lag, less the part of them that noise gives, add up to the energy. An exponential window
    e^(-s t) on the records leaves most noise early in them. So lines l apart have a correlation of 1 / (1 + i pi l / d)
    in their noise, d being s over the spacing of lines. Noise of any level gives no mean then, either.

    Args:
        left: (n,) the residual, real or complex.
        decay: d; 0 for noise that is independent from line to line.
    """
    count, total = left.size, float(np.vdot(left, left).real)
    lags = _lags(count)
    if not lags.size or total == 0.0:
        return 0.0, 1.0
    products = np.array([float(np.vdot(left[:-lag], left[lag:]).real) * count / (count - lag) for lag in lags])
    of_noise = _correlation(lags, decay).real
    energy = float(np.mean((products - of_noise * total) / (1 - of_noise)))
    return energy, total * _relative_deviation(count, decay, is_real=not np.iscomplexobj(left))


def _lags(count: int) -> Indices:
    return np.array([lag for lag in (1, 2) if count > lag], dtype=np.intp)


def _correlation(lags: Indices, decay: float) -> Complex:
    """Correlation of the noise of lines that are `lags` apart, as `energy_of` says."""
    return np.asarray(decay / (decay + 1j * np.pi * lags) if decay else lags == 0, dtype=complex)


@lru_cache(maxsize=1024)
def _relative_deviation(count: int, decay: float, is_real: bool) -> float:
    """Standard deviation of the energy of noise over its sum of squares, for any number of lines.

    The energy of n lines x is x^H A x, where A is constant along its diagonals, and their noise has the covariance C.
    Gaussian noise then has the variance tr(A C A C) in the energy, which is zero in the mean, and n^2 + tr(C C) is the
    mean square of x^H x; real noise has twice these traces.
    """
    lags = _lags(count)
    of_noise = _correlation(lags, decay).real
    beside = count / (count - lags) / (1 - of_noise) / (2 * lags.size)
    diagonals = {0: -float(np.mean(of_noise / (1 - of_noise)))}
    diagonals |= {sign * int(lag): float(each) for lag, each in zip(lags, beside, strict=True) for sign in (1, -1)}
    variance, square = (_trace(each, count, decay) * (2 if is_real else 1) for each in (diagonals, {0: 1.0}))
    return float(np.sqrt(variance / (count**2 + square)))


def _trace(diagonals: Mapping[int, float], count: int, decay: float) -> float:
    """tr(A C A C), the sum over i and k of A[i, i + p] C[i + p, k] A[k, k + q] C[k + q, i]; A has these diagonals."""
    apart, found = np.arange(1 - count, count), 0.0  # i - k
    for p, q in product(diagonals, repeat=2):
        first = np.maximum(max(0, -p), max(0, -q) + apart)  # of the i for which A has both places
        end = np.minimum(count - max(0, p), count - max(0, q) + apart)
        each = np.maximum(end - first, 0) * _correlation(p + apart, decay) * _correlation(q - apart, decay)
        found += diagonals[p] * diagonals[q] * float(np.sum(each).real)
    return found


def lines_with_common_noise(decay: float) -> float:
    """Number of neighbouring lines that tell as much as one line with noise of its own: 1 without a window.

    It is the sum over all lags of the squared correlation that `energy_of` takes off; `decay` is the same.
    """
    return float(decay / np.tanh(decay)) if decay > 0 else 1.0


@dataclass(frozen=True)
class Misfit:
    """Misfit beyond noise of both rigs together, in squared standard deviations.

    Attributes:
        energy: of the misfit, on which neighbours agree; scatters about zero without misfit.
        deviation: standard deviation of `energy` without misfit.
        excess: sum of squares beyond what noise of `LOUDEST` times the variance would leave; below zero where noise may
            explain all. It counts far from any fit, where neighbours at a sharp peak need not agree.
        common_noise: most of `lines_with_common_noise` of any residual.
    """

    energy: float
    deviation: float
    excess: float
    common_noise: float = 1.0

    @property
    def certain(self) -> float:
        """The misfit that is certain."""
        return max(0.0, self.energy - CHANCE_LIMIT * self.deviation, self.excess)

    @property
    def significance(self) -> float:
        """The misfit over the standard deviation of its energy without misfit."""
        return max(self.energy, self.excess, 0.0) / self.deviation


def misfit_of(
    residuals: Sequence[Complex | Real], decays: Sequence[float] | None = None, weights: Sequence[float] | None = None
) -> Misfit:
    """The misfit in whitened residuals, real or complex (n,) each, of which neighbours are next to each other.

    `decays` are as of `energy_of`, for each residual; none by default. The misfit in each counts with its weight.
    """
    decays = [0.0] * len(residuals) if decays is None else decays
    counts = np.ones(len(residuals)) if weights is None else np.asarray(weights)
    energy, deviation = np.array(list(map(energy_of, residuals, decays))).T
    excess = [
        float(np.vdot(left, left).real) - LOUDEST * left.size * (2 if np.iscomplexobj(left) else 1)
        for left in residuals
    ]
    return Misfit(
        energy=float(counts @ energy),
        deviation=float(np.linalg.norm(counts * deviation)),
        excess=float(counts @ np.array(excess)),
        common_noise=max(map(lines_with_common_noise, decays)),
    )
