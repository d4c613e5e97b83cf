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


def energy_of(left: Complex) -> tuple[float, float]:
    """Energy of the misfit in a whitened residual (n,) of neighbours, and its standard deviation without misfit.

    Lags of one and of two together; noise of any level gives products without a mean.
    """
    count, total = left.size, float(np.vdot(left, left).real)
    lags = [lag for lag in (1, 2) if count > lag]
    products = [float(np.vdot(left[:-lag], left[lag:]).real) * count / (count - lag) for lag in lags]
    # a product of two complex numbers of power p has a real part of variance p^2 / 2; two lags halve it
    deviation = total / np.sqrt(2 * max(count, 1)) / np.sqrt(max(len(lags), 1))
    return (float(np.mean(products)) if products else 0.0), float(deviation) or 1.0


@dataclass(frozen=True)
class Misfit:
    """Misfit beyond noise of both rigs together, in squared standard deviations.

    Attributes:
        energy: of the misfit, on which neighbours agree; scatters about zero without misfit.
        deviation: standard deviation of `energy` without misfit.
        excess: sum of squares beyond what noise of `LOUDEST` times the variance would leave; below zero where noise may
            explain all. It counts far from any fit, where neighbours at a sharp peak need not agree.
    """

    energy: float
    deviation: float
    excess: float

    @property
    def certain(self) -> float:
        """The misfit that is certain."""
        return max(0.0, self.energy - CHANCE_LIMIT * self.deviation, self.excess)

    @property
    def significance(self) -> float:
        """The misfit over the standard deviation of its energy without misfit."""
        return max(self.energy, self.excess, 0.0) / self.deviation


def misfit_of(residuals: Sequence[Complex]) -> Misfit:
    """The misfit in whitened residuals, real or complex (n,) each, of which neighbours are next to each other."""
    parts = [each if np.iscomplexobj(each) else _paired(each) for each in residuals]
    energies, deviations = zip(*map(energy_of, parts), strict=True)
    return Misfit(
        energy=sum(energies),
        deviation=float(np.sqrt(sum(deviation**2 for deviation in deviations))),
        excess=sum(float(np.vdot(left, left).real) - LOUDEST * 2 * left.size for left in parts),
    )


def _paired(left: Complex) -> Complex:
    """Every two neighbours of a real residual as one complex number, which keeps their scatter and correlation."""
    even = np.concatenate([left, np.zeros(1)]) if left.size % 2 else left
    return np.asarray(even[0::2] + 1j * even[1::2])
