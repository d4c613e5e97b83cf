"""Effects of where and how the joints hold the beam."""

from dataclasses import dataclass, replace
from itertools import combinations_with_replacement
from typing import ClassVar, Self

import numpy as np

from analysis.frequency_response import Complex
from analysis.gap.bench import BeamBench, Mounting, Setting
from analysis.gap.effect import Effect, EffectOfEachJoint, Given, Mechanism
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter


class SupportPosition(EffectOfEachJoint):
    """Each joint sits up to 10 mm along the beam from its place in the drawing."""

    id = "support_position"
    title = "joints beside their drawn place"
    mechanism = Mechanism.JOINT_GEOMETRY
    form_is_known = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"dx_{name}", "m", 0.0, 0.006) for name in self.names)

    def mounting(self, given: Given, mounting: Mounting) -> Mounting:
        return replace(mounting, position=mounting.position + self.at_joints(given, "dx"))


@dataclass(frozen=True)
class CylinderAngle(Effect):
    """Both cylinders of one joint lean up to 5 degrees more than drawn; steeper is positive: k22 grows and k11 falls.

    Attributes:
        joint: its index in the drawing.
        steeper: 1 or -1, the sense in which theta turns when the cylinders become steeper.
    """

    id = "cylinder_angle"
    title = "cylinders at another angle"
    mechanism = Mechanism.JOINT_GEOMETRY
    law = "both alike"
    form_is_known = True
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("delta_deg", "deg", 0.0, 3.3),)
    joint: int = 0
    steeper: float = 1.0

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return tuple(
            cls(place, -float(np.sign(np.sin(2 * joint.inclinations[0]))) or 1.0)
            for place, joint in enumerate(measurement.drawing.joints)
        )

    def mounting(self, given: Given, mounting: Mounting) -> Mounting:
        concerned = np.arange(len(mounting.inclination)) == self.joint
        turn = self.steeper * given["delta_deg"] * np.pi / 180
        return replace(mounting, inclination=mounting.inclination + (concerned * turn)[:, None])


class SplayedCylinders(CylinderAngle):
    """The upper cylinder of the joint leans further than the lower one, by up to 2 degrees about their mean."""

    law = "each cylinder its own"
    own_parameters = (*CylinderAngle.own_parameters, Parameter("splay_deg", "deg", 0.0, 1.3))

    def mounting(self, given: Given, mounting: Mounting) -> Mounting:
        found = super().mounting(given, mounting)
        concerned = np.arange(len(found.inclination)) == self.joint
        apart = self.steeper * given["splay_deg"] / 2 * np.pi / 180 * np.array([-1.0, 1.0])
        return replace(found, inclination=found.inclination + concerned[:, None] * apart)


class VerticalOffset(EffectOfEachJoint):
    """Both cylinders of a joint sit off the beam's axis, by up to 5 mm for each joint: k13 and k23 appear."""

    id = "vertical_offset"
    title = "cylinders off the beam's axis"
    mechanism = Mechanism.JOINT_GEOMETRY
    form_is_known = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"shift_{name}", "m", 0.0, 0.0033) for name in self.names)

    def mounting(self, given: Given, mounting: Mounting) -> Mounting:
        return replace(mounting, eccentricity=mounting.eccentricity + self.at_joints(given, "shift")[:, None])


class ContactPatch(Effect):
    """Stiffness acts over a length of the beam, 10 to 40 mm for a cap: k33 grows by k22 l^2 / 12 at all joints."""

    id = "contact_patch"
    title = "stiffness spread over a length"
    mechanism = Mechanism.JOINT_GEOMETRY
    own_parameters = (Parameter("length", "m", 0.02, 0.5, positive=True, starts=(0.0, 1.4)),)
    imitated_by = frozenset({"c"})

    def mounting(self, given: Given, mounting: Mounting) -> Mounting:
        return replace(mounting, length=mounting.length + given["length"])


class SpreadContactPatch(ContactPatch):
    """`ContactPatch` on a beam that bends within the length: joints feel its mean motion there, not that of the middle.

    A rotational stiffness of the cylinders could imitate `ContactPatch`; it cannot imitate this.
    """

    law = "on a beam that bends"
    seen_in_one_step = False  # rotational stiffness has to fall as far as the patch raises it

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, joint_reach=bench.joint_reach + given["length"])


class LopsidedContactPatch(EffectOfEachJoint):
    """`ContactPatch`, pressed harder at one end: each joint acts beside its drawn place, by a share of the length.

    Pressure that changes linearly over the length, from nothing to twice its mean at most, moves its centre by up to a
    sixth of the length.
    """

    id = "contact_patch"
    title = ContactPatch.title
    mechanism = Mechanism.JOINT_GEOMETRY
    law = "pressed harder at one end"
    imitated_by = ContactPatch.imitated_by

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*ContactPatch.own_parameters, *(Parameter(f"aside_{name}", "1", 0.0, 0.1) for name in self.names))

    def mounting(self, given: Given, mounting: Mounting) -> Mounting:
        aside = given["length"] * self.at_joints(given, "aside")
        return replace(mounting, position=mounting.position + aside, length=mounting.length + given["length"])


TERMS = tuple(combinations_with_replacement(range(3), 2))
"""Rows and columns of a symmetric joint matrix."""


class JointOfAnyGeometry(EffectOfEachJoint):
    """Every term of every joint matrix changes by a share of the direct terms, with the joint's own loss."""

    id = "joint_geometry"
    title = "joints that hold the beam in another way"
    mechanism = Mechanism.JOINT_GEOMETRY
    law = "each term its own"
    law_free = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(
            Parameter(f"k{row + 1}{column + 1}_{name}", "1", 0.0, 0.1) for name in self.names for row, column in TERMS
        )

    def joints(self, given: Given, joints: Complex, pole: Complex) -> Complex:
        changed = joints.copy()
        for joint, name in enumerate(self.names):
            direct = np.sqrt(np.abs(np.diagonal(joints[:, :, joint], axis1=-2, axis2=-1)))
            lossy = joints[:, :, joint, 1, 1] / np.abs(joints[:, :, joint, 1, 1])
            for row, column in TERMS:
                change = given[f"k{row + 1}{column + 1}_{name}"] * direct[..., row] * direct[..., column] * lossy
                changed[:, :, joint, row, column] += change
                if row != column:
                    changed[:, :, joint, column, row] += change
        return changed
