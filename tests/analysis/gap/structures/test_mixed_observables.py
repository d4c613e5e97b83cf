"""Curves of several observables in one diagnosis, each in its own unit: deflection in m beside stress in Pa."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from analysis.frequency_response import Complex
from analysis.gap.effect import Given, Mechanism
from analysis.gap.evidence.verdict import Status
from analysis.gap.parameter import Parameter
from analysis.gap.structures.callable_simulator import CallableSimulator
from analysis.gap.structures.curve import Conditions, Curve
from analysis.gap.structures.diagnosis import CurveDiagnosis, diagnose_curves
from analysis.gap.structures.effect import Properties, StructureEffect
from analysis.gap.structures.left_out import LeftOutPrediction, percent_of

PLACES = np.linspace(0.1, 1.0, 19)


class Softening(StructureEffect):
    """Shows in the deflection alone."""

    id, title, mechanism = "softening", "modulus falls with load", Mechanism.BEAM
    own_parameters = (Parameter("per_100_n", "1", 0.0, 0.05),)

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        return {**properties, "modulus": properties["modulus"] * (1 - given["per_100_n"] * conditions["load"] / 100)}


class GaugeError(StructureEffect):
    """Shows in the stress alone."""

    id, title, mechanism = "gauge_error", "the gauge saturates", Mechanism.MEASURING_CHAIN
    own_parameters = (Parameter("per_100_mpa", "1", 0.0, 0.05),)

    def reading(self, given: Given, values: Complex, curve: Curve) -> Complex:
        if curve.observable != "stress":
            return values
        return np.asarray(values * (1 - given["per_100_mpa"] * np.abs(values) / 1e8))


def cantilever(parameters: Mapping[str, Any], conditions: Conditions) -> Complex:
    """Of 1 m length and a square cross-section, with a load at its end."""
    place, load, side = conditions["place"], conditions["load"], parameters["side"]
    deflection = load * place**2 * (3 - place) / (parameters["modulus"] * side**4 / 2)
    return np.asarray(np.where(conditions["gauge"] > 0, 6 * load * (1 - place) / side**3, deflection))


BEAM = CallableSimulator(
    cantilever,
    (Parameter("modulus", "Pa", 210e9, 0.01, positive=True), Parameter("side", "m", 0.03, 0.005, positive=True)),
    (Softening(), GaugeError()),
)


def measured(seed: int, softening: float, gauge: float) -> list[Curve]:
    random, curves = np.random.default_rng(seed), []
    for load in (50.0, 100.0, 200.0):
        for number, observable in enumerate(("deflection", "stress")):
            given = {"modulus": 211e9 * (1 - softening * load / 100), "side": 0.0301}
            conditions = {name: np.full(19, value) for name, value in (("load", load), ("gauge", float(number)))}
            exact = cantilever(given, {**conditions, "place": PLACES})
            exact = exact * (1 - gauge * number * exact / 1e8)
            deviation = np.full(19, 0.005 * np.sqrt(np.mean(exact**2)))
            values = exact + deviation * random.standard_normal(19)
            curves.append(Curve(observable, f"{load:g} N", values, deviation, {**conditions, "place": PLACES}))
    return curves


def in_other_units(curves: list[Curve]) -> list[Curve]:
    """Stress in units of 100 MPa."""
    return [
        replace(each, values=each.values / 1e8, deviation=each.deviation / 1e8) if each.observable == "stress" else each
        for each in curves
    ]


def ten_per_cent_off(curve: Curve) -> LeftOutPrediction:
    factor = 1.1 if curve.observable == "stress" else 1.0
    return LeftOutPrediction(curve, np.asarray(factor * curve.values, dtype=complex))


def diagnosed(curves: list[Curve]) -> CurveDiagnosis:
    return diagnose_curves(BEAM, curves)


@pytest.mark.parametrize("seed", range(8))
def test_an_effect_that_shows_in_one_observable_is_named_whatever_the_units_of_the_other_are(seed: int) -> None:
    found = diagnosed(measured(seed, 0.03, 0.0))
    assert (found.status, found.effects) == (Status.EXPLAINED, ("softening",))


def test_the_effect_of_the_other_observable_is_named_too() -> None:
    assert diagnosed(measured(1, 0.0, 0.1)).effects == ("gauge_error",)


def test_a_gap_in_per_cent_does_not_depend_on_units() -> None:
    curves = measured(1, 0.05, 0.0)
    off, other = ([ten_per_cent_off(each) for each in own] for own in (curves, in_other_units(curves)))
    assert percent_of(off) == pytest.approx(10 / np.sqrt(2))
    assert percent_of(other) == pytest.approx(percent_of(off))
