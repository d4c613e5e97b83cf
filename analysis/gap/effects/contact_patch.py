"""Stiffness that acts over a length of the bar and not at a point: caps are 10 to 40 mm long."""

from __future__ import annotations

from dataclasses import dataclass, replace

from analysis.gap.bench import Mounting
from analysis.gap.effect import Effect, Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class ContactPatch(Effect):
    """k33 grows by k22 l^2 / 12, at all joints alike."""

    id = "contact_patch"
    title = "stiffness spread over a length"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("length", "m", 0.02, 0.5, positive=True),)

    def mounting(self, given: Given, mounting: Mounting) -> Mounting:
        return replace(mounting, length=mounting.length + given["length"])
