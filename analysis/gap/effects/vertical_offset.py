"""Cylinders that are not symmetric about the bar's axis, by up to 5 mm: k13 and k23 appear."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from analysis.gap.bench import Mounting
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class VerticalOffset(Effect):
    """Both cylinders of a joint are shifted alike, each joint by its own distance."""

    id = "vertical_offset"
    title = "cylinders off the bar's axis"
    names: tuple[str, ...] = ()

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return (cls(tuple(joint.name for joint in measurement.drawing.joints)),)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"shift_{name}", "m", 0.0, 0.0033) for name in self.names)

    def mounting(self, given: Given, mounting: Mounting) -> Mounting:
        shift = np.array([given[f"shift_{name}"] for name in self.names])
        return replace(mounting, eccentricity=mounting.eccentricity + shift[:, None])
