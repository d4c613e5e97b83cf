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
        factor = 1 - given["d"] * self._done(given, loading.fraction)
        return cylinders.scaled(factor, factor)

    def _done(self, _given: Given, fraction: Real) -> Real:
        return fraction


@dataclass(frozen=True)
class SaturatingDrift(ConditioningDrift):
    """The drift comes to rest: most of it is over after a share `knee` of the test."""

    law = "saturating"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*super().parameters, Parameter("knee", "1", 0.3, 0.8, positive=True))

    def _done(self, given: Given, fraction: Real) -> Real:
        rate = 1 / given["knee"]
        return np.asarray((1 - np.exp(-rate * fraction)) / (1 - np.exp(-rate)))


@dataclass(frozen=True)
class LogarithmicDrift(ConditioningDrift):
    """The drift goes with the logarithm of the cycles."""

    law = "logarithmic"

    def _done(self, _given: Given, fraction: Real) -> Real:
        return np.asarray(np.log1p(100 * fraction) / np.log(101))
