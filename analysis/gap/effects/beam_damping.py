"""Loss of the bar beyond its free damping: cables, bolts, coatings; up to 1 %."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter

ETA = Parameter("eta", "1", 0.0, 0.0067, least=0.0)
REFERENCE = 200.0
"""Hz, where a loss factor that follows frequency has the value that is reported."""


@dataclass(frozen=True)
class BeamDamping(Effect):
    """A loss factor that is the same at all frequencies."""

    id = "beam_damping"
    title = "damping in the bar"
    law = "structural"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (ETA,)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, loss=bench.loss + given["eta"])


@dataclass(frozen=True)
class DampingFollowingFrequency(BeamDamping):
    """A loss factor that is a power of frequency: 1 for a viscous material, -1 for drag."""

    law = "power of frequency"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return ETA, Parameter("power", "1", 0.0, 0.5)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, loss=bench.loss + given["eta"] * (setting.frequency / REFERENCE) ** given["power"])


@dataclass(frozen=True)
class DampingOfModes(BeamDamping):
    """Every mode is damped by the same further ratio, half of a loss factor at its resonance."""

    law = "a ratio more for each mode"

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, ratio=bench.ratio + given["eta"] / 2)


@dataclass(frozen=True)
class MoreFreeDamping(BeamDamping):
    """All damping ratios of the free bar grow in proportion.

    Attributes:
        highest: of the drawing's damping ratios, that of the highest modes, which gains half the loss factor.
    """

    law = "ratios in proportion"
    highest: float = 1.0

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        ratios = measurement.drawing.damping_ratios
        return (cls(highest=ratios[-1]),) if np.any(np.asarray(ratios[-1:]) > 0) else ()

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, damping=bench.damping + given["eta"] / 2 / self.highest)
