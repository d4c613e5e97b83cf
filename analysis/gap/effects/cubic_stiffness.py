"""Stiffness that grows or falls with the square of the amplitude, without loss."""

from __future__ import annotations

from dataclasses import dataclass

from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import Effect, Given
from analysis.gap.effects.amplitude_dependence import BLOW_AMPLITUDE, FALL, blow_amplitude
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class CubicStiffness(Effect):
    """k (1 + beta x^2); at 0.05 mm zero to peak a beta of 1e8 makes 25 %."""

    id = "cubic_stiffness"
    title = "cubic stiffness"
    law = "square of amplitude"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("beta", "1/m^2", 0.0, 1e8), BLOW_AMPLITUDE, FALL)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        amplitude = blow_amplitude(given, loading, component=True)
        return cylinders.scaled(1 + given["beta"] * amplitude**2, 1.0)


@dataclass(frozen=True)
class SaturatingStiffness(CubicStiffness):
    """k (1 + beta x^2 / (1 + (x / x_s)^2)): the change levels off beyond an amplitude x_s."""

    law = "levelling off"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*super().parameters, Parameter("x_s", "m", 60e-6, 0.7, positive=True))

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        square = blow_amplitude(given, loading, component=True) ** 2
        return cylinders.scaled(1 + given["beta"] * square / (1 + square / given["x_s"] ** 2), 1.0)
