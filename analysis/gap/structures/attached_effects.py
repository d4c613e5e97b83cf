"""Effects on a structure given by its modes: attached parts, another place of the support, a softer substructure."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from analysis.gap.effect import Given, Mechanism
from analysis.gap.parameter import Parameter
from analysis.gap.structures.curve import Conditions, Curve
from analysis.gap.structures.effect import Properties, StructureEffect
from analysis.gap.structures.measured_amplitude import check_scale
from analysis.gap.structures.modes import Attached, NormalModes

KNOWN = frozenset({"frequency", "mode", "amplitude", "force", "time"})
"""Conditions with a meaning of their own; any other is the reading of a sensor, such as a thermometer, that an effect
may follow if it changes."""
POSITION_SHARE = 0.1
"""Standard deviation of a support's motion over the range of a sensor, as a share of the structure's length."""
MODULUS_SHARE = 0.02
"""Standard deviation of the change of stiffness over the range of a sensor, relative."""


def attached_effects(
    modes: NormalModes, attached: Sequence[Attached], curves: Sequence[Curve], largest: float | None
) -> tuple[StructureEffect, ...]:
    """All effects of this file that these curves could show.

    Args:
        modes: of the structure.
        attached: parts that the model has attached to it.
        curves: measured.
        largest: displacement that was measured under a known force, over the largest shape at its place, m kg^1/2; zero
            if none is other than zero, None where no force is known.
    """
    found = list[StructureEffect]()
    readings = dict[str, list[float]]()
    for each in curves:
        for name in sorted(set(each.conditions) - KNOWN):
            readings.setdefault(name, []).extend(each.conditions[name].tolist())
    sensors = [(name, own[0], float(np.ptp(own))) for name, own in readings.items() if np.ptp(own)]
    movable = modes.coordinates is not None and bool(attached) and not isinstance(attached[0].place, str)
    if movable and modes.coordinates is not None:
        length = float(np.ptp(modes.coordinates))
        found.append(SupportElsewhere(length))
        found += [SupportFollows(*sensor, length) for sensor in sensors]
    found += [ModulusFollows(*sensor) for sensor in sensors]
    places = modes.dofs if modes.coordinates is None else tuple(modes.coordinates[[len(modes.dofs) // 2, -1]].tolist())
    for place in places:
        largest_shape = float(np.max(np.abs(modes.at(place))))
        if not largest_shape:  # it does not move, so nothing shows there
            continue
        weight = 1 / largest_shape**2  # kg: the least modal mass there; degrees of freedom may differ in unit
        stiffness = weight * (2 * np.pi * float(np.max(modes.frequencies[:3]))) ** 2
        found += [PointMass(place, weight), PointSpring(place, stiffness)]
        if largest is not None:
            own = largest * largest_shape
            found += [CubicPointSpring(place, stiffness, own), FrictionSpring(place, stiffness, own)]
        if any(each.is_complex for each in curves):
            found += [PointDashpot(place, weight), Absorber(place, weight, float(modes.frequencies[-1]))]
    found += [SofterPart(name) for name in modes.parts]
    if any(each.is_complex for each in curves):
        found.append(ViscousRatio())
    return tuple(found)


@dataclass(frozen=True)
class AtPlace(StructureEffect, ABC):
    """A lumped part that is attached at one place.

    Attributes:
        place: a degree of freedom, or a coordinate.
        size: kg or N/m, mass or stiffness of the structure there, to which parameters refer; for a rotation, kg m^2 or
            N m/rad.
    """

    mechanism: ClassVar[Mechanism] = Mechanism.ATTACHMENT
    form_is_known: ClassVar[bool] = True
    place: str | float = ""
    size: float = 1.0

    @abstractmethod
    def attached(self, given: Given) -> Attached:
        """The attached part."""

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """The properties with one attached part more."""
        del conditions
        return {**properties, "attached": (*properties["attached"], self.attached(given))}


class PointMass(AtPlace):
    """A mass at one place."""

    id = "added_mass"
    title = "a mass that the model lacks"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Half-normal prior, up to about a fifth of the least modal mass there."""
        return (Parameter("mass", "kg", 0.0, 0.2 * self.size, least=0.0, starts=(0.1,)),)

    def attached(self, given: Given) -> Attached:
        """The mass."""
        return Attached(self.place, mass=given["mass"])


class PointSpring(AtPlace):
    """A spring to the ground at one place."""

    id = "added_spring"
    title = "a spring that the model lacks"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Half-normal prior, up to about a fifth of the modal stiffness of the third mode."""
        return (Parameter("stiffness", "N/m", 0.0, 0.2 * self.size, least=0.0, starts=(0.01,)),)

    def attached(self, given: Given) -> Attached:
        """The spring."""
        return Attached(self.place, stiffness=given["stiffness"])


@dataclass(frozen=True)
class OfAmplitudeAtPlace(AtPlace, ABC):
    """A spring at one place whose stiffness follows its amplitude; where no force is known, it has that at rest.

    Attributes:
        largest: displacement of this place, m, by the measured ones and the shapes, to which parameters refer; zero if
            there is none.
    """

    mechanism: ClassVar[Mechanism] = Mechanism.JOINT_AMPLITUDE
    largest: float = 1.0


class CubicPointSpring(OfAmplitudeAtPlace):
    """A spring to the ground whose force grows with the cube of displacement."""

    id = "added_cubic_spring"
    title = "a cubic spring that the model lacks"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Prior of about a fifth of the modal stiffness of the third mode, at the largest displacement.

        Raises:
            AnalysisError: that is zero.
        """
        check_scale(self.largest)
        return (Parameter("cubic", "N/m3", 0.0, 0.2 * self.size / self.largest**2, starts=(0.01, -0.01)),)

    def attached(self, given: Given) -> Attached:
        """The spring."""
        return Attached(self.place, cubic=given["cubic"])


class FrictionSpring(OfAmplitudeAtPlace):
    """A spring to the ground that slips under dry friction (Jenkins element)."""

    id = "friction_spring"
    title = "a spring that slips"
    law = "Jenkins element"
    form_is_known = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Stiffness as of `PointSpring`; it slips from a displacement of some tenths of the largest.

        Raises:
            AnalysisError: that is zero.
        """
        check_scale(self.largest)
        return (
            Parameter("stiffness", "N/m", 0.0, 0.2 * self.size, least=0.0, starts=(0.1, 0.01)),
            Parameter("slips_from", "m", 0.2 * self.largest, 1.0, positive=True),
        )

    def attached(self, given: Given) -> Attached:
        """The spring."""
        stiffness = given["stiffness"]
        return Attached(self.place, stiffness=stiffness, slip=stiffness * given["slips_from"])


class PointDashpot(AtPlace):
    """A viscous damper to the ground at one place."""

    id = "added_damper"
    title = "a damper that the model lacks"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Half-normal prior."""
        return (Parameter("damping", "N s/m", 0.0, 20.0 * self.size, least=0.0, starts=(0.1,)),)

    def attached(self, given: Given) -> Attached:
        """The damper."""
        return Attached(self.place, damping=given["damping"])


@dataclass(frozen=True)
class Absorber(AtPlace):
    """A mass on a spring at one place.

    Attributes:
        highest: frequency up to which it may be tuned, Hz.
    """

    id: ClassVar[str] = "absorber"
    title: ClassVar[str] = "something that resonates on the structure"
    highest: float = 1.0

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The search for its frequency starts from four values."""
        return (
            Parameter("mass", "kg", 0.0, 0.1 * self.size, least=0.0, starts=(0.1, 0.1, 0.1, 0.1)),
            Parameter("tuned", "Hz", self.highest / 4, 0.7, positive=True, starts=(-2.0, -1.0, 0.0, 1.0)),
            Parameter("loss", "1", 0.05, 1.0, positive=True),
        )

    def attached(self, given: Given) -> Attached:
        """The absorber."""
        return Attached(self.place, mass=given["mass"], tuned=given["tuned"], tuned_loss=given["loss"])


@dataclass(frozen=True)
class SupportElsewhere(StructureEffect):
    """The support is not where the model has it.

    Attributes:
        length: of the structure, m.
    """

    id: ClassVar[str] = "support_position"
    title: ClassVar[str] = "the support is elsewhere"
    mechanism: ClassVar[Mechanism] = Mechanism.JOINT_GEOMETRY
    law: ClassVar[str] = "one place"
    form_is_known: ClassVar[bool] = True
    length: float = 1.0

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Prior of some per cent of the length."""
        return (Parameter("shift", "m", 0.0, 0.03 * self.length),)

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """The support, moved by the same distance for all values."""
        del conditions
        return {**properties, "support": properties["support"] + given["shift"]}


@dataclass(frozen=True)
class Following(StructureEffect):
    """An effect that follows the reading of a sensor.

    Attributes:
        sensor: name of the condition.
        reference: its reading where the model is right.
        span: range of its readings.
    """

    sensor: str = ""
    reference: float = 0.0
    span: float = 1.0

    @property
    def needs(self) -> frozenset[str]:  # type: ignore[override]  # each object has a sensor of its own
        """The sensor."""
        return frozenset({self.sensor})

    def change(self, conditions: Conditions) -> np.ndarray:
        """(n,) change of the reading."""
        return np.asarray(conditions[self.sensor] - self.reference)


@dataclass(frozen=True)
class SupportFollows(Following):
    """The support moves with the reading of a sensor.

    Attributes:
        length: of the structure, m.
    """

    id: ClassVar[str] = "support_position"
    title: ClassVar[str] = "the support is elsewhere"
    mechanism: ClassVar[Mechanism] = Mechanism.JOINT_GEOMETRY
    form_is_known: ClassVar[bool] = True
    law: ClassVar[str] = "moves with a sensor"
    length: float = 1.0

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Prior of a tenth of the length over the range of the sensor."""
        return (Parameter("per_reading", "m", 0.0, POSITION_SHARE * self.length / self.span, starts=(0.5, -0.5)),)

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """The support, moved in proportion to the change of the reading."""
        return {**properties, "support": properties["support"] + given["per_reading"] * self.change(conditions)}


class ModulusFollows(Following):
    """The stiffness of the structure changes with the reading of a sensor."""

    id = "modulus_change"
    title = "the structure becomes softer or stiffer"
    mechanism = Mechanism.BEAM
    law = "follows a sensor"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Prior of two per cent over the range of the sensor."""
        return (Parameter("per_reading", "1", 0.0, MODULUS_SHARE / self.span),)

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """The modulus, changed in proportion to the change of the reading."""
        return {**properties, "modulus": properties["modulus"] * (1 + given["per_reading"] * self.change(conditions))}


@dataclass(frozen=True)
class SofterPart(StructureEffect):
    """A substructure is softer or stiffer than in the model.

    Attributes:
        part: its name.
    """

    id: ClassVar[str] = "substructure_stiffness"
    title: ClassVar[str] = "a part is softer or stiffer than in the model"
    mechanism: ClassVar[Mechanism] = Mechanism.BEAM
    form_is_known: ClassVar[bool] = True
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("share", "1", 0.0, 0.3),)
    part: str = ""

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """The stiffness of the substructure, relative."""
        del conditions
        name = f"part:{self.part}"
        return {**properties, name: properties[name] * (1 + given["share"])}


class ViscousRatio(StructureEffect):
    """Viscous damping of every mode, in addition to the structural damping."""

    id = "viscous_damping"
    title = "damping is viscous, not structural"
    mechanism = Mechanism.BEAM
    form_is_known = True
    own_parameters = (Parameter("ratio", "1", 0.0, 0.01, least=0.0, starts=(0.3,)),)

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """Damping ratio of every mode."""
        del conditions
        return {**properties, "damping_ratio": properties["damping_ratio"] + given["ratio"]}
