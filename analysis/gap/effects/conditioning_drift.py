"""Specimens that soften while they are cycled, in the order of measuring: up to 10 % (Mullins' effect, slow part)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import Effect, Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class ConditioningDrift(Effect):
    """Stiffness and loss fall in proportion to the share of the test that is done."""

    id = "conditioning_drift"
    title = "drift in the order of measuring"
    law = "straight"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("d", "1", 0.0, 0.067),)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        if not loading.tester:
            return cylinders
        factor = 1 - given["d"] * self._done(loading.fraction)
        return cylinders.scaled(factor, factor)

    def _done(self, fraction: Real) -> Real:
        return fraction


@dataclass(frozen=True)
class SaturatingDrift(ConditioningDrift):
    """Most of the drift comes in the first third."""

    law = "saturating"

    def _done(self, fraction: Real) -> Real:
        return np.asarray((1 - np.exp(-3 * fraction)) / (1 - np.exp(-3)))


@dataclass(frozen=True)
class LogarithmicDrift(ConditioningDrift):
    """The drift goes with the logarithm of the cycles."""

    law = "logarithmic"

    def _done(self, fraction: Real) -> Real:
        return np.asarray(np.log1p(100 * fraction) / np.log(101))
