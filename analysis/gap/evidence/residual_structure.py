"""Misfit that remains after a fit beyond noise, without knowledge of how large the noise is.

Noise differs from line to line; a misfit does not. The products of neighbouring whitened residuals therefore add up to
the energy of the misfit alone, and to nothing where the model holds (G. M. Ljung, G. E. P. Box, Biometrika 65, 1978).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex
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


def energy_of(left: Complex, decay: float = 0.0) -> tuple[float, float]:
    """Energy of the misfit in a whitened residual (n,) of neighbours, and its standard deviation without misfit.

    Products of neighbours at a lag, less the part of them that noise gives, add up to the energy. An exponential window
    e^(-s t) on the records leaves most noise early in them. So lines l apart have a correlation of 1 / (1 + i pi l / d)
    in their noise, d being s over the spacing of lines. Noise of any level gives no mean then, either.

    Args:
        left: (n,) the residual.
        decay: d; 0 for noise that is independent from line to line.
    """
    count, total = left.size, float(np.vdot(left, left).real)
    lags = np.array([lag for lag in (1, 2) if count > lag])
    if not lags.size or total == 0.0:
        return 0.0, 1.0
    products = np.array([float(np.vdot(left[:-lag], left[lag:]).real) * count / (count - lag) for lag in lags])
    of_noise = decay**2 / (decay**2 + (np.pi * lags) ** 2)
    # noise is independent from instant to instant of the record, t = 0 to 1, and counts with these weights there
    instants = (np.arange(count) + 0.5) / count
    weights = np.mean((np.cos(2 * np.pi * np.outer(instants, lags)) - of_noise) / (1 - of_noise), axis=1)
    power = np.exp(-2 * decay * instants)
    deviation = total * float(np.sqrt(np.sum((power * weights) ** 2)) / np.sum(power))
    return float(np.mean((products - of_noise * total) / (1 - of_noise))), deviation


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
    residuals: Sequence[Complex], decays: Sequence[float] | None = None, weights: Sequence[float] | None = None
) -> Misfit:
    """The misfit in whitened residuals, real or complex (n,) each, of which neighbours are next to each other.

    `decays` are as of `energy_of`, for each residual; none by default. The misfit in each counts with its weight.
    """
    parts = [each if np.iscomplexobj(each) else _paired(each) for each in residuals]
    decays = [0.0] * len(parts) if decays is None else decays
    counts = np.ones(len(parts)) if weights is None else np.asarray(weights)
    energy, deviation = np.array(list(map(energy_of, parts, decays))).T
    excess = [float(np.vdot(left, left).real) - LOUDEST * 2 * left.size for left in parts]
    return Misfit(
        energy=float(counts @ energy),
        deviation=float(np.linalg.norm(counts * deviation)),
        excess=float(counts @ np.array(excess)),
        common_noise=max(map(lines_with_common_noise, decays)),
    )


def _paired(left: Complex) -> Complex:
    """Every two neighbours of a real residual as one complex number, which keeps their scatter and correlation."""
    even = np.concatenate([left, np.zeros(1)]) if left.size % 2 else left
    return np.asarray(even[0::2] + 1j * even[1::2])
