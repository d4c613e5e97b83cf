"""Functions and effects that others wrote: what they do with arrays, and the errors that they raise."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex
from analysis.gap.effect import Given
from analysis.gap.structures.callable_simulator import CallableSimulator
from analysis.gap.structures.curve import Conditions, Curve
from analysis.gap.structures.diagnosis import diagnose_curves
from analysis.gap.structures.effect import Properties, StructureEffect
from tests.analysis.gap.structures.warm_spring import (
    Warmth,
    measured,
    simulator,
    spring,
    warm,
)


def test_a_simulator_with_an_error_is_named() -> None:
    def broken(parameters: Mapping[str, Any], conditions: Conditions) -> Complex:
        raise ValueError("no licence")

    bad = CallableSimulator(broken, simulator().parameters, (Warmth(),), name="solver of the bridge")
    with pytest.raises(AnalysisError, match=r"solver of the bridge fails .* no licence"):
        diagnose_curves(bad, measured(warm))


def test_a_condition_that_was_not_measured_is_named_where_a_function_asks_for_it() -> None:
    def loaded(parameters: Mapping[str, Any], conditions: Conditions) -> Complex:
        return np.asarray(parameters["k"] * conditions["load"])

    with pytest.raises(AnalysisError, match=r"asks for 'load', .* no condition .*; conditions are frequency, temp"):
        diagnose_curves(replace(simulator(), function=loaded), measured(warm))


def test_a_function_that_ends_the_program_is_an_error_of_its_simulator() -> None:
    def licensed(parameters: Mapping[str, Any], conditions: Conditions) -> Complex:
        raise SystemExit("no licence server")

    with pytest.raises(AnalysisError, match=r"simulator callable fails for .* SystemExit: no licence server"):
        diagnose_curves(replace(simulator(), function=licensed), measured(warm))


class WritesInPlace(Warmth):
    """As warmth, but by a change of the readings in their own array."""

    id = "writes_in_place"

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        return properties

    def reading(self, given: Given, values: Complex, curve: Curve) -> Complex:
        values *= 1 - given["per_kelvin"] * (curve.conditions["temperature"] - 20)
        return values


@pytest.mark.parametrize("effect", [Warmth(), WritesInPlace()])
def test_a_function_that_keeps_the_array_which_it_gives_has_the_verdict_of_one_that_does_not(
    effect: StructureEffect,
) -> None:
    buffer, kept = np.empty(15, dtype=complex), dict[bytes, Complex]()

    def writes_again(parameters: Mapping[str, Any], conditions: Conditions) -> Complex:
        buffer[:] = spring(parameters, conditions)
        return buffer

    def remembers(parameters: Mapping[str, Any], conditions: Conditions) -> Complex:
        key = np.array([*np.ravel(parameters["k"]), parameters["loss"]]).tobytes()
        return kept.setdefault(key, spring(parameters, conditions))

    given = simulator(effect)
    expected = diagnose_curves(given, measured(warm))
    assert expected.effects == (effect.id,)
    for function in (writes_again, remembers):
        found = diagnose_curves(replace(given, function=function), measured(warm))
        assert (found.status, found.effects) == (expected.status, expected.effects)
        assert found.after == pytest.approx(expected.after)
