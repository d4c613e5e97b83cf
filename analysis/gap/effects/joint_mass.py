"""Mass that moves with the bar at the joints, caps and bolts: up to 0.3 kg."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.effect import Effect, EffectOfEachJoint, Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class JointMass(Effect):
    """The same mass at every joint."""

    id = "joint_mass"
    title = "mass at the joints"
    law = "equal masses"
    form_is_known = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("m", "kg", 0.0, 0.2, least=0.0),)

    def joints(self, given: Given, joints: Complex, pole: Complex) -> Complex:
        return joints + inertia(np.full(joints.shape[1], given["m"]), pole)


@dataclass(frozen=True)
class MassOfEachJoint(EffectOfEachJoint):
    """A mass of its own at each joint."""

    id = "joint_mass"
    title = "mass at the joints"
    law = "each joint its own"
    form_is_known = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"m_{name}", "kg", 0.0, 0.2, least=-0.01) for name in self.names)

    def joints(self, given: Given, joints: Complex, pole: Complex) -> Complex:
        return joints + inertia(self.at_joints(given, "m"), pole)


def inertia(masses: Real, pole: Complex) -> Complex:
    """(lines, joints, 3, 3) dynamic stiffness of point masses (joints,) in kg."""
    return np.asarray(np.multiply.outer(pole**2, np.multiply.outer(masses, np.diag([1.0, 1.0, 0.0]))))
