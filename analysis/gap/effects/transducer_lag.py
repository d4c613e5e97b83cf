"""Force that leads displacement by different filters, e^(i w tau): up to 300 us."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import TesterPoints
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class TransducerLag(Effect):
    """Lag between the tester's transducers."""

    id = "transducer_lag"
    title = "lag between the tester's transducers"
    law = "delay"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("tau", "s", 0.0, 200e-6),)

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return np.asarray(stiffness * np.exp(2j * np.pi * points.frequency * given["tau"]))


@dataclass(frozen=True)
class FilteredDisplacement(TransducerLag):
    """Displacement passes a filter of first order that force does not pass."""

    law = "filter of first order"

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return np.asarray(stiffness * (1 + 2j * np.pi * points.frequency * given["tau"]))
