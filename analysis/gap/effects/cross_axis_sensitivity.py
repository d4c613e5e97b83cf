"""Axial motion that leaks into the accelerometer: data sheets allow 5 %."""

from __future__ import annotations

from dataclasses import dataclass, replace

from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class CrossAxisSensitivity(Effect):
    """Cross-axis sensitivity of the accelerometer."""

    id = "cross_axis_sensitivity"
    title = "cross-axis sensitivity of the accelerometer"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("sensitivity", "1", 0.0, 0.033),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, cross_axis=bench.cross_axis + given["sensitivity"])
