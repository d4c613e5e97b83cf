"""Joints that sit beside where the drawing has them, by up to 10 mm along the bar."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from analysis.gap.bench import Mounting
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class SupportPosition(Effect):
    """Each joint is off by its own distance."""

    id = "support_position"
    title = "joints beside their drawn place"
    names: tuple[str, ...] = ()

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return (cls(tuple(joint.name for joint in measurement.drawing.joints)),)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"dx_{name}", "m", 0.0, 0.006) for name in self.names)

    def mounting(self, given: Given, mounting: Mounting) -> Mounting:
        return replace(mounting, position=mounting.position + np.array([given[f"dx_{name}"] for name in self.names]))
