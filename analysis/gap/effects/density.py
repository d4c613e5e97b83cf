"""Density: steels and a bar's true section differ by up to 2 %."""

from __future__ import annotations

from dataclasses import dataclass, replace

from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class Density(Effect):
    """Density off."""

    id = "density"
    title = "density off"
    form_is_known = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("relative", "1", 0.0, 0.0133),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, density=bench.density + given["relative"])
