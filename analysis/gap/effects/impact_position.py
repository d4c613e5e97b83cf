"""Points struck off their marks, the same in every set: up to 8 mm by a wrong mark or a thick finger."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from analysis.dof import Direction
from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class ImpactPosition(Effect):
    """Each of the points struck across the bar may be off."""

    id = "impact_position"
    title = "points struck beside their marks"
    law = "each point its own"
    form_is_known = True
    nodes: tuple[int, ...] = ()

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        nodes = {dof.node for each in measurement.sets for dof in each.inputs if dof.direction is Direction.Y}
        return (cls(tuple(sorted(nodes))),)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"shift_{node}", "m", 0.0, 0.004) for node in self.nodes)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        shift = np.array(
            [given.get(f"shift_{dof.node}", 0.0) if dof.direction is Direction.Y else 0.0 for dof in setting.inputs]
        )
        return replace(bench, blow_offset=bench.blow_offset + shift)
