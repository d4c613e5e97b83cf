"""Young's modulus: handbooks of steels differ by 3 %."""

from __future__ import annotations

from dataclasses import dataclass, replace

from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class YoungsModulus(Effect):
    """Young's modulus off."""

    id = "youngs_modulus"
    title = "Young's modulus off"
    form_is_known = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("relative", "1", 0.0, 0.02),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, modulus=bench.modulus + given["relative"])
