"""Mass between specimen and force transducer, k - w^2 m: up to 0.2 kg."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import Configuration, TesterPoints
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class FixtureInertia(Effect):
    """Inertia of the tester's fixture."""

    id = "fixture_inertia"
    title = "inertia of the tester's fixture"
    law = "one fixture"
    form_is_known = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("m", "kg", 0.0, 0.133, least=0.0),)

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return stiffness - given["m"] * (2 * np.pi * points.frequency) ** 2


@dataclass(frozen=True)
class InertiaOfEachFixture(FixtureInertia):
    """Each configuration has a fixture of its own, and masses differ a little."""

    law = "a fixture for each configuration"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*super().parameters, *(Parameter(name, "1", 1.0, 0.15) for name in _SHARES))

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        shares = np.array([given[name] for name in _SHARES])[points.configuration]
        return np.asarray(stiffness - given["m"] * shares * (2 * np.pi * points.frequency) ** 2)


_SHARES = tuple(f"share_{configuration.name.lower()}" for configuration in Configuration)
