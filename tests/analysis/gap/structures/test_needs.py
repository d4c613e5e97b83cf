"""An effect acts on the curves that have the conditions it needs, and on no others."""

from typing import ClassVar

import numpy as np
import pytest

from analysis.frequency_response import Complex, Real
from analysis.gap.effect import Given, Mechanism
from analysis.gap.parameter import Parameter
from analysis.gap.structures.attached_effects import FrictionSpring, ModulusFollows, PointSpring, SupportFollows
from analysis.gap.structures.callable_simulator import CallableSimulator
from analysis.gap.structures.chain_effects import Delay, GainSlope
from analysis.gap.structures.curve import Conditions, Curve
from analysis.gap.structures.diagnosis import diagnose_curves
from analysis.gap.structures.effect import Acting, Properties, StructureEffect, lacking
from analysis.gap.structures.material_effects import Arrhenius, ExponentialInTemperature, WilliamsLandelFerry
from analysis.gap.structures.modal_structure import ModalStructure
from analysis.gap.structures.modes import NormalModes
from analysis.gap.structures.single_degree import SingleDegree

RUBBER = SingleDegree((Parameter("stiffness", "N/m", 1e5, 0.1, True), Parameter("loss_factor", "1", 0.1, 0.3, True)))
CENTRES = {each.name: each.centre for each in RUBBER.parameters}
MODES = NormalModes.of_matrices(np.eye(2), 1e5 * np.array([[2.0, -1.0], [-1.0, 1.0]]), ("a", "b"), 2)


class Warm(StructureEffect):
    id: ClassVar[str] = "warm"
    title: ClassVar[str] = "it softens with temperature"
    mechanism: ClassVar[Mechanism] = Mechanism.JOINT_STATE
    needs: ClassVar[frozenset[str]] = frozenset({"temperature"})
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("per_kelvin", "1/K", 0.0, 0.005),)

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        softer = 1 - given["per_kelvin"] * (conditions["temperature"] - 20)
        return {**properties, "a": properties["a"] * softer}


def curve(observable: str, **conditions: Real) -> Curve:
    size = next(iter(conditions.values())).size
    return Curve(observable, "a", np.ones(size, dtype=complex), np.ones(size), conditions)


def test_one_curve_without_a_thermometer_does_not_lose_the_effect_of_temperature() -> None:
    x, random, curves = np.linspace(0.1, 3.0, 40), np.random.default_rng(0), []
    for temperature in (20.0, 40.0, 60.0, None):
        exact = 2 * (1 - 0.004 * ((temperature or 20.0) - 20)) * x
        conditions = {"x": x} | ({} if temperature is None else {"temperature": np.full(40, temperature)})
        values = exact + 0.005 * random.standard_normal(40)
        curves.append(Curve("y", f"{temperature}", values, np.full(40, 0.005), conditions))

    def line(parameters: Properties, conditions: Conditions) -> Complex:
        return np.asarray(parameters["a"] * conditions["x"])

    model = CallableSimulator(line, (Parameter("a", "1", 2.0, 0.05, True),), (Warm(),))
    found = diagnose_curves(model, curves)
    assert found.effects == ("warm",)
    assert not found.failures
    assert lacking(Warm(), curves) == 1


@pytest.mark.parametrize(
    ("effect", "given"),
    [
        (ExponentialInTemperature(), {"per_kelvin": 0.01}),
        (WilliamsLandelFerry(), {"c1": 10.0, "c2": 150.0}),
        (Arrhenius(), {"activation": 200.0}),
    ],
)
def test_laws_of_temperature_leave_a_curve_without_one_as_it_is(effect: StructureEffect, given: Given) -> None:
    plain = curve("stiffness", frequency=np.array([1.0, 10.0]))
    found = RUBBER.predict(CENTRES, [Acting(effect, given)], plain)
    np.testing.assert_array_equal(found, RUBBER.predict(CENTRES, [], plain))


@pytest.mark.parametrize("effect", [Delay(), GainSlope()])
def test_effects_of_the_chain_leave_natural_frequencies_as_they_are(effect: StructureEffect) -> None:
    plain = curve("frequencies", mode=np.array([1.0, 2.0]))
    given = {each.name: each.value(1.0) for each in effect.parameters}
    found = ModalStructure(MODES).predict({}, [Acting(effect, given)], plain)
    np.testing.assert_array_equal(found, ModalStructure(MODES).predict({}, [], plain))


@pytest.mark.parametrize("kind", [ModulusFollows, SupportFollows])
def test_an_effect_that_follows_a_sensor_needs_it(kind: type[ModulusFollows | SupportFollows]) -> None:
    effect = kind("humidity")
    assert effect.needs == {"humidity"}
    plain = curve("frequencies", mode=np.array([1.0, 2.0]))
    found = ModalStructure(MODES).predict({}, [Acting(effect, {"per_reading": 0.01})], plain)
    np.testing.assert_array_equal(found, ModalStructure(MODES).predict({}, [], plain))


def test_a_spring_that_slips_has_its_stiffness_at_rest_where_no_force_is_known() -> None:
    asked = curve("frequencies", mode=np.array([1.0, 2.0]))
    slips = Acting(FrictionSpring("b", 1.0, 1e-3), {"stiffness": 2e4, "slips_from": 1e-4})
    spring = Acting(PointSpring("b"), {"stiffness": 2e4})
    found, expected = (ModalStructure(MODES).predict({}, [each], asked) for each in (slips, spring))
    np.testing.assert_array_equal(found, expected)


def test_a_law_of_temperature_acts_on_a_record_with_its_mean_temperature() -> None:
    time = np.arange(400) / 200.0
    force = np.random.default_rng(0).standard_normal(400)
    record = curve("displacement", time=time, force=force, temperature=np.linspace(29.0, 31.0, 400))
    values = {"stiffness": 2e4, "mass": 1.0, "loss_factor": 0.05}
    warm = RUBBER.predict(values, [Acting(ExponentialInTemperature(), {"per_kelvin": 0.01})], record)
    softer = RUBBER.predict({**values, "stiffness": 2e4 * np.exp(-0.1)}, [], record)
    np.testing.assert_allclose(warm, softer)
