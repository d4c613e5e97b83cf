"""Mass between specimen and force transducer, k - w^2 m: up to 0.2 kg."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import TesterPoints
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class FixtureInertia(Effect):
    """Inertia of the tester's fixture."""

    id = "fixture_inertia"
    title = "inertia of the tester's fixture"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("m", "kg", 0.0, 0.133, least=0.0),)

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return stiffness - given["m"] * (2 * np.pi * points.frequency) ** 2
