"""Measured curves, which no simulator and no effect can change."""

import pickle
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.gap.effect import Given, Mechanism
from analysis.gap.parameter import Parameter
from analysis.gap.structures.callable_simulator import CallableSimulator
from analysis.gap.structures.curve import Conditions, Curve, checked
from analysis.gap.structures.diagnosis import diagnose_curves
from analysis.gap.structures.effect import StructureEffect

TEMPERATURE = np.linspace(10.0, 40.0, 12)
K = Parameter("k", "N/m", 100.0, 0.1, positive=True)


def measured() -> list[Curve]:
    noise = np.random.default_rng(2).standard_normal((3, 12))
    values = 100.0 * (1 + 1e-3 * noise)
    return [
        Curve("stiffness", str(n), each, np.full(12, 0.1), {"temperature": TEMPERATURE})
        for n, each in enumerate(values)
    ]


def constant(parameters: Mapping[str, Any], conditions: Conditions) -> Complex:
    return np.asarray(parameters["k"] * np.ones(conditions["temperature"].size))


def in_place(parameters: Mapping[str, Any], conditions: Any) -> Complex:
    kelvin = conditions["temperature"]
    kelvin += 273.15
    return np.asarray(parameters["k"] * kelvin / kelvin)


class Thermometer(StructureEffect):
    """Off by some kelvin, written over the readings themselves."""

    id, title, mechanism = "thermometer", "the thermometer is off", Mechanism.MEASURING_CHAIN
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("off", "K", 0.0, 5.0),)

    def conditions(self, given: Given, conditions: Any) -> Conditions:
        conditions["temperature"][:] += given["off"]
        return dict(conditions)


class OtherThermometer(Thermometer):
    id = "other_thermometer"

    def conditions(self, given: Given, conditions: Any) -> Conditions:
        conditions["temperature"] = conditions["temperature"] + given["off"]
        return dict(conditions)


def test_a_simulator_that_writes_over_conditions_is_told_with_its_name_and_measured_conditions_stay() -> None:
    curves = measured()
    with pytest.raises(AnalysisError, match=r"simulator kelvin fails for stiffness .*read-only"):
        diagnose_curves(CallableSimulator(in_place, (K,), name="kelvin"), curves)
    assert np.array_equal(curves[0].conditions["temperature"], np.linspace(10.0, 40.0, 12))


@pytest.mark.parametrize("bad", [Thermometer(), OtherThermometer()])
def test_an_effect_that_writes_over_conditions_is_left_out_and_named(bad: StructureEffect) -> None:
    curves = measured()
    found = diagnose_curves(CallableSimulator(constant, (K,), (bad,)), curves)
    (failure,) = found.failures
    assert bad.id in failure.effect
    assert bad.id in failure.reason
    assert np.array_equal(curves[0].conditions["temperature"], np.linspace(10.0, 40.0, 12))


def test_a_curve_keeps_what_was_measured_when_its_source_changes() -> None:
    values, load = np.ones(3), np.arange(3.0)
    curve = Curve("stiffness", "a", values, np.ones(3), {"load": load})
    values[0], load[0] = 9.0, 9.0
    assert (curve.values[0], curve.conditions["load"][0]) == (1.0, 0.0)


def test_a_curve_goes_to_another_process_and_stays_read_only() -> None:
    curve = Curve("stiffness", "a", np.full(3, 2.0 + 1.0j), np.full(3, 0.1), {"load": np.arange(3.0)})
    again: Curve = pickle.loads(pickle.dumps(curve))
    assert (again.observable, again.part, list(again.conditions)) == ("stiffness", "a", ["load"])
    pairs: list[tuple[Complex | Real, Complex | Real]] = [
        (curve.values, again.values),
        (curve.deviation, again.deviation),
        (curve.conditions["load"], again.conditions["load"]),
    ]
    for one, other in pairs:
        assert np.array_equal(one, other)
        assert not other.flags.writeable


def test_curves_of_which_no_value_counts_are_told_by_their_deviations() -> None:
    curves = [replace(each, deviation=np.full(each.values.size, np.inf)) for each in measured()]
    with pytest.raises(AnalysisError, match="no value counts: all deviations are infinite"):
        checked(curves)
