"""The protocol of an effect on any structure: its name, its parameters, and what it changes.

A simulator computes its curves from *properties* by name (`stiffness`, `mass`, `loss_factor` ...), each a number or
(n,) numbers for the values of a curve. An effect changes conditions, properties or readings; a method that it does not
override changes nothing. A new effect is one subclass.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar

from analysis.frequency_response import Complex
from analysis.gap.effect import EffectLaw, Given
from analysis.gap.structures.curve import Conditions, Curve

Properties = Mapping[str, Any]
"""Properties of a structure, by name, from which a simulator computes; each simulator documents its own."""
Variant = dict[str, str | int | float]
"""Fields, by name, that tell an effect from others of its class: its place, its part or the sensor that it follows."""
PLACE = "place"
"""Name of the field that says where an effect acts: a degree of freedom, or a coordinate, m."""


@dataclass(frozen=True)
class StructureEffect(EffectLaw):
    """An effect under one law. Fields of a subclass tell its variants from each other; reports have `variant_of` it."""

    needs: ClassVar[frozenset[str]] = frozenset()
    """Conditions without which it cannot show; curves that lack one stay as they are."""

    def conditions(self, given: Given, conditions: Conditions) -> Conditions:
        """Change the conditions that properties follow, such as the temperature of a specimen."""
        return conditions

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """Change properties of the structure, for each value of a curve."""
        return properties

    def reading(self, given: Given, values: Complex, curve: Curve) -> Complex:
        """Change the (n,) readings of a curve: sensors, cables, filters."""
        return values


@dataclass(frozen=True)
class Acting:
    """An effect with values of its parameters."""

    effect: StructureEffect
    given: Given


def label_of(effect: StructureEffect) -> str:
    """Id and law, for messages."""
    return f"{effect.id} ({effect.law})"


def variant_of(effect: StructureEffect) -> Variant:
    """Fields of an effect that are texts or whole numbers, and its place; other numbers are sizes of its priors."""
    own = {each.name: getattr(effect, each.name) for each in fields(effect)}
    return {name: value for name, value in own.items() if isinstance(value, (str, int)) or _is_coordinate(name, value)}


def _is_coordinate(name: str, value: Any) -> bool:
    return name == PLACE and isinstance(value, float)


def acts_under(effect: StructureEffect, conditions: Conditions) -> bool:
    """Whether the conditions are all there that an effect needs.

    `amplitude` counts as there where a force is known.
    """
    return effect.needs <= set(conditions) | ({"amplitude"} if "force" in conditions else set())


def properties_under(acting: Sequence[Acting], properties: Properties, conditions: Conditions) -> Properties:
    """Properties after the changes by all effects that act there; effects that change conditions act first."""
    for each in acting:
        if acts_under(each.effect, conditions):
            conditions = each.effect.conditions(each.given, conditions)
    for each in acting:
        if acts_under(each.effect, conditions):
            properties = each.effect.properties(each.given, properties, conditions)
    return properties


def read_by(acting: Sequence[Acting], values: Complex, curve: Curve) -> Complex:
    """Readings of a curve after the changes by all effects that act there."""
    for each in acting:
        if acts_under(each.effect, curve.conditions):
            values = each.effect.reading(each.given, values, curve)
    return values


def showing(effects: Sequence[StructureEffect], curves: Sequence[Curve]) -> tuple[StructureEffect, ...]:
    """Effects whose conditions were all measured in some curve."""
    return tuple(each for each in effects if any(acts_under(each, curve.conditions) for curve in curves))


def lacking(effect: StructureEffect, curves: Sequence[Curve]) -> int:
    """Number of curves on which an effect does not act, as they lack a condition that it needs."""
    return sum(not acts_under(effect, each.conditions) for each in curves)
