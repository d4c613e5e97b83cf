"""Structural loss of the bar beyond its free damping: cables, bolts, coatings; up to 1 %."""

from __future__ import annotations

from dataclasses import dataclass, replace

from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class BeamDamping(Effect):
    """Damping in the bar."""

    id = "beam_damping"
    title = "damping in the bar"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("eta", "1", 0.0, 0.0067, least=0.0),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, loss=bench.loss + given["eta"])
