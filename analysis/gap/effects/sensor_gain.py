"""One factor on all accelerances: sensitivities of hammer or accelerometer off by up to 5 %."""

from __future__ import annotations

from dataclasses import dataclass, replace

from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class SensorGain(Effect):
    """Gain of hammer or accelerometer."""

    id = "sensor_gain"
    title = "gain of hammer or accelerometer"
    form_is_known = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("gain", "1", 0.0, 0.033),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, chain=bench.chain * (1 + given["gain"]))
