"""Mass that moves with the bar at the joints, caps and bolts: up to 0.3 kg."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from analysis.frequency_response import Complex
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class JointMass(Effect):
    """The same mass at every joint."""

    id = "joint_mass"
    title = "mass at the joints"
    law = "equal masses"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("m", "kg", 0.0, 0.2, least=0.0),)

    def joints(self, given: Given, joints: Complex, pole: Complex) -> Complex:
        return joints + inertia([given["m"]] * joints.shape[1], pole)


@dataclass(frozen=True)
class MassOfEachJoint(Effect):
    """A mass of its own at each joint."""

    id = "joint_mass"
    title = "mass at the joints"
    law = "each joint its own"
    names: tuple[str, ...] = ()

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return (cls(tuple(joint.name for joint in measurement.drawing.joints)),)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"m_{name}", "kg", 0.0, 0.2, least=-0.01) for name in self.names)

    def joints(self, given: Given, joints: Complex, pole: Complex) -> Complex:
        return joints + inertia([given[f"m_{name}"] for name in self.names], pole)


def inertia(masses: list[float], pole: Complex) -> Complex:
    """(lines, joints, 3, 3) dynamic stiffness of point masses (joints,) in kg."""
    return np.asarray(np.multiply.outer(pole**2, np.multiply.outer(np.array(masses), np.diag([1.0, 1.0, 0.0]))))
