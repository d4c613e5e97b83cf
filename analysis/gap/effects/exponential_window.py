"""An exponential window e^(-s t) on both channels that nobody stated: H is seen at i w + s, beside a stated one."""

from __future__ import annotations

from dataclasses import dataclass, replace

from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class ExponentialWindow(Effect):
    """Exponential window not corrected."""

    id = "exponential_window"
    title = "exponential window not corrected"
    form_is_known = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("s", "1/s", 0.0, 6.7, least=0.0),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, pole=bench.pole + given["s"])
