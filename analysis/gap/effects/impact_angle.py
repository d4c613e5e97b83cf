"""Blows that lean by a few degrees: part of the force goes along the bar, or across it for a blow on its end."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from analysis.dof import Direction, Dof
from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class ImpactAngle(Effect):
    """Transverse blows lean alike, and pull along the axis."""

    id = "impact_angle"
    title = "blows that lean"
    law = "transverse blows, at the axis"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("angle_deg", "deg", 0.0, 2.7),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        leaning = np.array([self.leans(dof) for dof in setting.inputs], dtype=float)
        return replace(bench, lean=bench.lean + leaning * given["angle_deg"] * np.pi / 180)

    def leans(self, dof: Dof) -> bool:
        """Whether blows at a point lean."""
        return dof.direction is Direction.Y


@dataclass(frozen=True)
class SurfaceBlows(ImpactAngle):
    """Transverse blows lean alike, and pull at the surface, half a height off the axis."""

    law = "transverse blows, at the surface"
    height: float = 0.0

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return (cls(measurement.drawing.beam.height / 2),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(super().beam(given, bench, setting), strike_height=self.height)


@dataclass(frozen=True)
class AllBlows(ImpactAngle):
    """All blows lean alike, those on the ends too."""

    law = "all blows"

    def leans(self, dof: Dof) -> bool:
        return True


@dataclass(frozen=True)
class BlowsAtOnePoint(ImpactAngle):
    """Blows lean at a point that is hard to reach.

    Attributes:
        point: which.
    """

    law = "blows at one point"
    point: Dof | None = None

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        points = {dof for each in measurement.sets for dof in each.inputs}
        return tuple(cls(point) for point in sorted(points, key=str))

    def leans(self, dof: Dof) -> bool:
        return dof == self.point
