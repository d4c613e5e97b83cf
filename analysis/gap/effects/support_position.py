"""Joints that sit beside where the drawing has them, by up to 10 mm along the bar."""

from __future__ import annotations

from dataclasses import dataclass, replace

from analysis.gap.bench import Mounting
from analysis.gap.effect import EffectOfEachJoint, Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class SupportPosition(EffectOfEachJoint):
    """Each joint is off by its own distance."""

    id = "support_position"
    title = "joints beside their drawn place"
    form_is_known = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"dx_{name}", "m", 0.0, 0.006) for name in self.names)

    def mounting(self, given: Given, mounting: Mounting) -> Mounting:
        return replace(mounting, position=mounting.position + self.at_joints(given, "dx"))
