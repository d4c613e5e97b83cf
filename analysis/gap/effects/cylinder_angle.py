"""Cylinders of one joint that lean otherwise than drawn, by up to 5 degrees."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from analysis.gap.bench import Mounting
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class CylinderAngle(Effect):
    """Both cylinders of one joint lean alike; positive is steeper, so that k22 grows and k11 falls.

    Attributes:
        joint: its place in the drawing.
        steeper: the sense in which theta turns then.
    """

    id = "cylinder_angle"
    title = "cylinders at another angle"
    form_is_known = True
    joint: int = 0
    steeper: float = 1.0

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return tuple(
            cls(place, -float(np.sign(np.sin(2 * joint.inclinations[0]))) or 1.0)
            for place, joint in enumerate(measurement.drawing.joints)
        )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("delta_deg", "deg", 0.0, 3.3),)

    def mounting(self, given: Given, mounting: Mounting) -> Mounting:
        concerned = np.arange(len(mounting.inclination)) == self.joint
        turn = self.steeper * given["delta_deg"] * np.pi / 180
        return replace(mounting, inclination=mounting.inclination + (concerned * turn)[:, None])
