"""Properties of a structure that differ from value to value of a curve, against a curve for each value."""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest

from analysis.frequency_response import Complex, Real
from analysis.gap.effect import Given, Mechanism
from analysis.gap.parameter import Parameter
from analysis.gap.structures.attached_effects import ModulusFollows
from analysis.gap.structures.curve import Conditions, Curve
from analysis.gap.structures.diagnosis import diagnose_curves
from analysis.gap.structures.effect import Acting, Properties, StructureEffect
from analysis.gap.structures.equal_values import equal_values
from analysis.gap.structures.modal_structure import ModalStructure
from analysis.gap.structures.modes import Attached, NormalModes

MASS, STIFF = np.eye(2), 1e5 * np.array([[2.0, -1.0], [-1.0, 1.0]])
LINK = 1e5 * np.array([[1.0, -1.0], [-1.0, 1.0]])
MODES = NormalModes.of_matrices(MASS, STIFF, ("a", "b"), 2, {"link": LINK})
LINE = replace(MODES, coordinates=np.array([0.0, 1.0]))
STRUCTURE = ModalStructure(LINE, (Attached(0.4, stiffness=3e4),))
VALUES = {"modulus": 1.0, "loss_factor": 0.02}
READING = np.array([0.0, 1.0, 0.5, 0.5, 2.0, 0.0])
"""Of a sensor, for each value of a curve."""
CONDITIONS: dict[str, dict[str, Real]] = {
    "frequencies": {"mode": np.array([1.0, 2.0, 1.0, 2.0, 1.0, 1.0])},
    "poles": {"mode": np.array([1.0, 2.0, 1.0, 2.0, 1.0, 1.0])},
    "receptance(a,b)": {"frequency": np.linspace(20.0, 100.0, 6)},
    "accelerance(b,b)": {"frequency": np.linspace(20.0, 100.0, 6), "force": np.full(6, 5.0)},
}


@dataclass(frozen=True)
class Changes(StructureEffect):
    """A property changes by a tenth for each unit of a reading; attached parts change by their stiffness."""

    id: ClassVar[str] = "changes"
    title: ClassVar[str] = "something changes with a reading"
    mechanism: ClassVar[Mechanism] = Mechanism.BEAM
    needs: ClassVar[frozenset[str]] = frozenset({"reading"})
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("share", "1", 0.0, 0.1),)
    changed: str = ""

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        share: Any = given["share"] * conditions["reading"]
        name = self.changed
        if name == "attached":
            return {**properties, name: (Attached("a", stiffness=1e4 * share), *properties[name])}
        if name == "slip":
            return {**properties, "attached": (*properties["attached"], Attached("b", stiffness=1e4, slip=1 + share))}
        return {**properties, name: properties[name] + share}


@pytest.mark.parametrize("observable", list(CONDITIONS))
@pytest.mark.parametrize(
    "name", ["modulus", "loss_factor", "damping_ratio", "support", "part:link", "attached", "slip"]
)
def test_a_property_that_differs_from_value_to_value_acts_on_each_value(name: str, observable: str) -> None:
    def predicted(places: list[int]) -> Complex:
        conditions = {each: own[places] for each, own in {**CONDITIONS[observable], "reading": READING}.items()}
        curve = Curve(observable, "a", np.ones(len(places), dtype=complex), np.ones(len(places)), conditions)
        return STRUCTURE.predict(VALUES, [Acting(Changes(name), {"share": 0.1})], curve)

    one_by_one = np.concatenate([predicted([place]) for place in range(6)])
    np.testing.assert_allclose(predicted(list(range(6))), one_by_one, rtol=1e-9)


def test_values_are_in_one_group_where_all_properties_are_numbers() -> None:
    (one,) = equal_values({"modulus": 1.0, "attached": (Attached("a"),)}, 4)
    assert one.places.tolist() == [0, 1, 2, 3]


def test_a_stiffness_that_falls_with_temperature_within_a_sweep_is_named() -> None:
    modes, random, curves = NormalModes.of_matrices(MASS, STIFF, ("a", "b"), 2), np.random.default_rng(0), []
    frequency = np.linspace(20.0, 120.0, 50)
    for part, (first, last) in (("cold", (20.0, 30.0)), ("warm", (30.0, 50.0))):
        temperature = np.linspace(first, last, 50)
        inverses = [
            np.linalg.inv(STIFF * (1 - 2e-3 * (each - 20)) * (1 + 0.02j) - (2 * np.pi * line) ** 2 * MASS)[0, 1]
            for line, each in zip(frequency, temperature, strict=True)
        ]
        deviation = np.full(50, 0.002 * np.max(np.abs(inverses)))
        values = np.array(inverses) + deviation * (random.standard_normal(50) + 1j * random.standard_normal(50))
        curves.append(
            Curve("receptance(a,b)", part, values, deviation, {"frequency": frequency, "temperature": temperature})
        )
    model = ModalStructure(modes)
    tried = [each for each in model.effects(curves) if each.id in ("modulus_change", "added_mass", "time_delay")]
    found = diagnose_curves(model, curves, tried)
    (effect,) = found.model.effects
    assert isinstance(effect, ModulusFollows)
    assert effect.sensor == "temperature"


def test_a_sensor_that_always_reads_the_same_is_followed_by_no_effect() -> None:
    conditions = {"mode": np.array([1.0, 2.0]), "temperature": np.full(2, 21.0)}
    offered = ModalStructure(LINE).effects([Curve("frequencies", "a", np.ones(2), np.ones(2), conditions)])
    assert not [each for each in offered if hasattr(each, "sensor")]
