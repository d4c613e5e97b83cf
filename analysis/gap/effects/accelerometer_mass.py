"""The accelerometer's mass, which the model leaves out: 2 to 40 g with its base and cable."""

from __future__ import annotations

from dataclasses import dataclass, replace

from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class AccelerometerMass(Effect):
    """Mass of the accelerometer."""

    id = "accelerometer_mass"
    title = "mass of the accelerometer"
    form_is_known = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("m", "kg", 0.0, 0.027, least=0.0),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, sensor_mass=bench.sensor_mass + given["m"])
