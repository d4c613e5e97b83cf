"""What remains after a fit beyond noise, without having to know how large the noise is.

Noise differs from line to line; a misfit does not. The products of neighbouring whitened residuals therefore add up to
the energy of the misfit alone, and to nothing where the model holds (G. M. Ljung, G. E. P. Box, Biometrika 65, 1978).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex
from analysis.gap.fit import Fit
from analysis.gap.measurement import Indices, TesterPoints

DOUBT = 3.0
"""Standard deviations within which a misfit may be chance."""
LOUDEST = 2.0
"""Times its stated variance that noise may be."""


@dataclass(frozen=True)
class Structure:
    """Misfit beyond noise of one row of accelerances, or of one series of the tester.

    Attributes:
        rig: "inverse" or "direct".
        place: (set, row), or (specimen, configuration, place of the amplitude).
        energy: estimate of the sum of squares of the whitened misfit; scatters about zero where there is none.
        deviation: its standard deviation where there is none.
        total: sum of squares of the whitened residual.
        data: number of real and imaginary parts.
    """

    rig: str
    place: tuple[int, ...]
    energy: float
    deviation: float
    total: float
    data: int


def structures(found: Fit) -> tuple[Structure, ...]:
    """Of every row and every series of a fitted model."""
    likelihood = found.likelihood
    predicted = likelihood.predict(found.scores, derivatives=False)
    result = []
    for number, each in enumerate(likelihood.measurement.sets):
        left = (each.accelerance - predicted.accelerances[number]) / each.deviation
        result += [_of("inverse", (number, row), left[row]) for row in range(len(left))]
    points = likelihood.measurement.points
    if points is not None:
        left = (points.stiffness - predicted.stiffness) / points.deviation
        result += [_of("direct", place, left[members]) for place, members in series(points).items()]
    return tuple(result)


def series(points: TesterPoints) -> dict[tuple[int, int, int], Indices]:
    """Places of the points of each specimen, configuration and amplitude, by rising frequency."""
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


def _of(rig: str, place: tuple[int, ...], left: Complex) -> Structure:
    energy, deviation = energy_of(left)
    return Structure(rig, place, energy, deviation, float(np.vdot(left, left).real), 2 * left.size)


@dataclass(frozen=True)
class Misfit:
    """Misfit beyond noise of both rigs together, in squared standard deviations.

    Attributes:
        energy: that neighbours agree on; scatters about zero where there is none.
        deviation: its standard deviation where there is none.
        excess: of the sum of squares over what noise of `LOUDEST` times the variance would leave; below zero where
            noise may explain all. Far from any fit neighbours at a sharp peak need not agree, and this then counts.
    """

    energy: float
    deviation: float
    excess: float

    @property
    def certain(self) -> float:
        """What is beyond doubt."""
        return max(0.0, self.energy - DOUBT * self.deviation, self.excess)


def misfit(found: Fit) -> Misfit:
    """Of a fitted model."""
    parts = structures(found)
    return Misfit(
        energy=sum(each.energy for each in parts),
        deviation=float(np.sqrt(sum(each.deviation**2 for each in parts))),
        excess=sum(each.total - LOUDEST * each.data for each in parts),
    )
