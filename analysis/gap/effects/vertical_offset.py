"""Cylinders that are not symmetric about the bar's axis, by up to 5 mm: k13 and k23 appear."""

from __future__ import annotations

from dataclasses import dataclass, replace

from analysis.gap.bench import Mounting
from analysis.gap.effect import EffectOfEachJoint, Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class VerticalOffset(EffectOfEachJoint):
    """Both cylinders of a joint are shifted alike, each joint by its own distance."""

    id = "vertical_offset"
    title = "cylinders off the bar's axis"
    form_is_known = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"shift_{name}", "m", 0.0, 0.0033) for name in self.names)

    def mounting(self, given: Given, mounting: Mounting) -> Mounting:
        return replace(mounting, eccentricity=mounting.eccentricity + self.at_joints(given, "shift")[:, None])
