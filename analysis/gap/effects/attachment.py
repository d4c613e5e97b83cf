"""Effects of what is fixed to the joints, and of their foundations."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.bench import mass_on_spring
from analysis.gap.effect import BentLaw, Effect, EffectOfEachJoint, Given, Mechanism
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter
from analysis.gap.smooth_curve import SmoothCurve

GYRATION = Parameter("gyration_squared", "m^2", 0.0, 0.015**2, least=0.0)
"""Square of the radius of gyration of caps and bolts about their own centre; their outer radius is a cylinder's."""
ASIDE = 0.005
"""Standard deviation, m, of the distance along the beam from a joint to the centre of its caps and bolts."""
ALONG = Parameter("along", "1", 1.0, 0.25)
"""Mass that moves along the beam over mass that moves across: rubber may hold them differently."""


class JointMass(Effect):
    """Caps and bolts move with the beam: the same mass at every joint, up to 0.3 kg."""

    id = "joint_mass"
    title = "mass at the joints"
    mechanism = Mechanism.ATTACHMENT
    law = "equal masses"
    form_is_known = True
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("m", "kg", 0.0, 0.2, least=0.0),)

    def joints(self, given: Given, joints: Complex, pole: Complex) -> Complex:
        return joints + inertia(np.full(joints.shape[2], given["m"]), pole)


class TurningMass(JointMass):
    """`JointMass` that turns with the beam: it also has an inertia about the joint's axis."""

    law = "equal masses with their inertia"
    own_parameters = (*JointMass.own_parameters, GYRATION)

    def joints(self, given: Given, joints: Complex, pole: Complex) -> Complex:
        masses = np.full(joints.shape[2], given["m"])
        return joints + inertia(masses, pole, given["gyration_squared"])


class MassOfEachJoint(EffectOfEachJoint):
    """A different mass at each joint, slightly beside it along the beam; all have the same radius of gyration."""

    id = "joint_mass"
    title = "mass at the joints"
    mechanism = Mechanism.ATTACHMENT
    law = "each joint its own"
    form_is_known = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        masses = (Parameter(f"m_{name}", "kg", 0.0, 0.2, least=-0.01) for name in self.names)
        return (*masses, GYRATION, *(Parameter(f"aside_{name}", "m", 0.0, ASIDE) for name in self.names), ALONG)

    def joints(self, given: Given, joints: Complex, pole: Complex) -> Complex:
        masses, aside = self.at_joints(given, "m"), self.at_joints(given, "aside")
        return joints + inertia(masses, pole, given["gyration_squared"], aside, given["along"])


def inertia(
    masses: Real, pole: Complex, gyration_squared: float = 0.0, aside: Real | float = 0.0, along: float = 1.0
) -> Complex:
    """(lines, joints, 3, 3) dynamic stiffness of masses at the joints.

    Args:
        masses: (joints,) kg.
        pole: (lines,) 1/s.
        gyration_squared: square of their radius of gyration about their own centre, m^2.
        aside: (joints,) distance of their centres from the joint along the beam, m.
        along: mass that moves along the beam over mass that moves across it.
    """
    aside = np.broadcast_to(aside, masses.shape)
    matrix = np.zeros((masses.size, 3, 3))
    matrix[:, 0, 0], matrix[:, 1, 1] = along, 1.0
    matrix[:, 1, 2] = matrix[:, 2, 1] = aside
    matrix[:, 2, 2] = gyration_squared + aside**2  # about the joint (Steiner)
    return np.asarray(np.multiply.outer(pole**2, masses[:, None, None] * matrix))


@dataclass(frozen=True)
class FoundationCompliance(Effect):
    """The foundation of one joint moves across the beam, in series with the joint: k_f (1 + i eta) - w^2 m_f.

    Its resonance lies between 30 and 1500 Hz.

    Attributes:
        joint: its index in the drawing.
    """

    id = "foundation_compliance"
    title = "foundation that gives way"
    mechanism = Mechanism.ATTACHMENT
    law = "across the beam"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("f", "Hz", 200.0, 1.0, positive=True, starts=(-1.4, -0.7, -0.2, 0.3, 0.9, 1.6)),
        Parameter("k_f", "N/m", 1.5e7, 1.0, positive=True, starts=(0.0, 2.5)),
        Parameter("eta", "1", 0.05, 0.7, positive=True),
    )
    directions: ClassVar[Real] = np.array([[0.0], [1.0], [0.0]])
    """(3, n) unit vectors (x, y, rotation) along which the foundation moves."""
    joint: int = 0

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return tuple(cls(place) for place in range(len(measurement.drawing.joints)))

    def bent(self, measurement: Measurement) -> Effect | None:
        return FoundationOfTwoModes(self.joint)

    def foundation(self, given: Given, pole: Complex) -> Complex:
        """(lines,) dynamic stiffness of the foundation."""
        return mass_on_spring(given["k_f"], given["eta"], given["f"], pole)

    def joints(self, given: Given, joints: Complex, pole: Complex) -> Complex:
        foundation = self.foundation(given, pole)
        changed = np.array(np.broadcast_to(joints, (len(joints), pole.size, *joints.shape[2:])))
        z, directions = changed[:, :, self.joint], self.directions
        base = directions.T @ z @ directions + foundation[:, None, None] * np.eye(directions.shape[1])
        changed[:, :, self.joint] = z - z @ directions @ np.linalg.solve(base, directions.T @ z)
        return changed


@dataclass(frozen=True)
class FoundationOfTwoModes(BentLaw, FoundationCompliance):
    """A foundation that stands on something that gives way, too: its compliance is that of two modes."""

    law = "two modes across the beam"
    own_parameters = (
        *FoundationCompliance.own_parameters,
        Parameter("f_second", "Hz", 200.0, 1.0, positive=True, starts=(-1.6, -0.8, 0.0, 0.8, 1.6)),
        Parameter("second_over_first", "1", 0.15, 1.2, positive=True, starts=(-1.0, 1.0)),
        Parameter("eta_second", "1", 0.05, 0.7, positive=True),
    )

    def foundation(self, given: Given, pole: Complex) -> Complex:
        stiffness = given["k_f"] / given["second_over_first"]
        second = mass_on_spring(stiffness, given["eta_second"], given["f_second"], pole)
        return np.asarray(1 / (1 / super().foundation(given, pole) + 1 / second))


@dataclass(frozen=True)
class FoundationBothWays(FoundationCompliance):
    """The foundation of one joint moves across and along the beam alike."""

    law = "across and along the beam"
    directions = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])

    def bent(self, measurement: Measurement) -> None:
        return None


OVER_BAND = SmoothCurve((15.0, 60.0, 150.0, 350.0, 800.0))


@dataclass(frozen=True)
class SmoothAttachment(Effect):
    """Any smooth dynamic stiffness across the beam at one joint, as a share of the joint's own.

    Attributes:
        joint: its index in the drawing.
    """

    id = "attachment"
    title = "something fixed to a joint or under it"
    mechanism = Mechanism.ATTACHMENT
    law = "smooth curve"
    law_free = True
    own_parameters = (*OVER_BAND.parameters("real", 0.2), *OVER_BAND.parameters("imaginary", 0.1))
    joint: int = 0

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        return tuple(cls(place) for place in range(len(measurement.drawing.joints)))

    def joints(self, given: Given, joints: Complex, pole: Complex) -> Complex:
        frequency = np.abs(pole.imag) / (2 * np.pi)
        share = OVER_BAND.at(given, "real", frequency) + 1j * OVER_BAND.at(given, "imaginary", frequency)
        changed = np.array(np.broadcast_to(joints, (len(joints), pole.size, *joints.shape[2:])))
        changed[:, :, self.joint, 1, 1] += share * np.abs(changed[:, :, self.joint, 1, 1])
        return changed
