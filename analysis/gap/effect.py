"""The definition of an effect: parameters with their priors, and the changes that they make to the bench."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar, Self

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.bench import BeamBench, Cylinders, Loading, Mounting, Setting
from analysis.gap.measurement import Measurement, Rig, TesterPoints
from analysis.gap.parameter import Parameter, ParameterEstimate

Given = Mapping[str, float]
"""Values of an effect's own parameters, by name."""


class Mechanism(StrEnum):
    """The physics that an effect belongs to; laws of one mechanism compete with each other within it."""

    JOINT_AMPLITUDE = "joint_amplitude"
    """Joints depend on amplitude."""
    JOINT_FREQUENCY = "joint_frequency"
    """Joints depend on frequency."""
    JOINT_STATE = "joint_state"
    """Joints depend on temperature, preload and history."""
    JOINT_GEOMETRY = "joint_geometry"
    """Where and how joints hold the beam."""
    ATTACHMENT = "attachment"
    """What is fixed to the joints or under them."""
    BEAM = "beam"
    """The beam and what rides on it."""
    BLOW = "blow"
    """How the hammer strikes."""
    MEASURING_CHAIN = "measuring_chain"
    """Sensors, cables and windows."""
    TESTER = "tester"
    """The elastomer tester itself."""


class LawOver(StrEnum):
    """What the stiffness of joints depends on under a law."""

    AMPLITUDE = "amplitude"
    """Zero to peak, m."""
    FREQUENCY = "frequency"
    """Hz."""
    ORDER = "order"
    """Share of the test that is done, 0 to 1."""
    PRELOAD = "preload"
    """Mean displacement, m; none under the beam."""
    TEMPERATURE = "temperature"
    """K above the tester's."""


@dataclass(frozen=True)
class EffectLaw:
    """An effect under one law, on whatever structure: its names and its parameters."""

    id: ClassVar[str]
    """Name in its catalogue, in JSON and on pages."""
    title: ClassVar[str]
    """A few words for tables and reports."""
    mechanism: ClassVar[Mechanism]
    law: ClassVar[str] = "the only one"
    """Name of the law, where rival laws share an id."""
    law_free: ClassVar[bool] = False
    """Whether this is a smooth function in place of a law: it decides whether its mechanism acts, and its id is that of
    the mechanism."""
    form_is_known: ClassVar[bool] = False
    """Whether a real structure follows the law exactly, as it does for a mass, a length or a delay."""
    own_parameters: ClassVar[tuple[Parameter, ...]] = ()
    """Parameters, where they are the same for all variants."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters with their full plausible ranges; those that can be zero are zero without the effect.

        An override may let them depend on the variant.
        """
        return self.own_parameters

    @property
    def expected(self) -> float:
        """Probability that it acts, by what instruments beside the data show; 0 where they say nothing of it."""
        return 0.0


@dataclass(frozen=True)
class Effect(EffectLaw):
    """An effect of the catalogue under one law.

    A subclass names itself by its class attributes and overrides the methods of the parts that it changes: each takes
    a part of the bench as the paper's model and earlier effects left it, and returns it changed. The fields of the
    dataclass distinguish variants, such as the joint that is concerned.
    """

    law_over: ClassVar[LawOver | None] = None
    """What the stiffness of joints depends on, for an effect that is a law of the joints."""
    follows_motion: ClassVar[bool] = False
    """Whether cylinders under the beam follow the motion that each row's own blows make at their joint."""
    reduces_motion: ClassVar[bool] = False
    """Whether it takes a part of the tester's motion, which the specimen then does not see."""
    seen_in_one_step: ClassVar[bool] = True
    """Whether one step of a linearised fit predicts its gain; otherwise it is fitted wherever it might show."""
    imitated_by: ClassVar[frozenset[str]] = frozenset()
    """Kinds of parameters of the paper's model that imitate it where it is not in a model. A fit of it starts once more
    with these at the centres of their priors."""
    by_row: ClassVar[bool] = False
    """Whether joints differ from row to row, also where they do not follow motion."""

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        """Variants that a measurement could show; by default the one without arguments."""
        return (cls(),)

    def bent(self, measurement: Measurement) -> Effect | None:
        """The same law with a deviation, whose parameters come after its own; None for a law without one."""
        return None

    @property
    def named_law(self) -> str:
        """The law that it is, or that it deviates from."""
        return self.law

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        """Change the elastomer, in both rigs."""
        return cylinders

    def mounting(self, given: Given, mounting: Mounting) -> Mounting:
        """Change how the cylinders hold the beam; angled pairs in the tester lean by the same change."""
        return mounting

    def setups(self, given: Given, setups: Real, setting: Setting) -> Real:
        """Change the factors (states, joints) by which set-ups change the stiffness of joints under the beam."""
        return setups

    def joints(self, given: Given, joints: Complex, pole: Complex) -> Complex:
        """Change joint matrices (states, lines or 1, joints, 3, 3) of the beam rig at `pole` (lines,)."""
        return joints

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        """Change beam, accelerometer, blows or measuring chain of the beam rig."""
        return bench

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        """Change the tester's reading, (points,) N/m."""
        return stiffness


class BentLaw(Effect):
    """Mixin before a law that has a deviation: it is fitted from where the law itself ends, and bends no further."""

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        """None of its own."""
        return ()

    def bent(self, measurement: Measurement) -> Effect | None:
        """None: it is bent already."""
        return None

    @property
    def named_law(self) -> str:
        """The law that it deviates from."""
        own = (each for each in type(self).__mro__ if issubclass(each, Effect) and not issubclass(each, BentLaw))
        return next(own).law


@dataclass(frozen=True)
class EffectOfEachJoint(Effect):
    """An effect with a parameter for each joint.

    Attributes:
        names: (joints,) of the drawing.
    """

    names: tuple[str, ...] = ()

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        """One variant, for all joints together."""
        return (cls(tuple(joint.name for joint in measurement.drawing.joints)),)

    def at_joints(self, given: Given, prefix: str) -> Real:
        """(joints,) values of the parameters whose names are the prefix and a joint's name."""
        return np.array([given[f"{prefix}_{name}"] for name in self.names])


METHODS_OF_RIG = {
    Rig.BEAM: ("cylinders", "mounting", "setups", "joints", "beam"),
    Rig.TESTER: ("cylinders", "mounting", "tester"),
}
"""Methods of an effect that change the readings of each rig."""


def acts_on(effect: Effect | type[Effect], method: str) -> bool:
    """Whether an effect overrides this method, and so changes that part of the bench."""
    law = effect if isinstance(effect, type) else type(effect)
    return getattr(law, method) is not getattr(Effect, method)


def acts_on_rig(effect: Effect | type[Effect], rig: Rig) -> bool:
    """Whether an effect changes the readings of a rig."""
    return any(acts_on(effect, method) for method in METHODS_OF_RIG[rig])


@dataclass(frozen=True)
class RecordEffect:
    """An effect of the catalogue that records of blows, or their averages, show without any fit.

    Attributes:
        id: in the catalogue.
        parameters: by name.
        fault: a sentence about it.
    """

    id: str
    parameters: dict[str, ParameterEstimate]
    fault: str
