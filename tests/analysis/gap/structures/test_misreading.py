"""Values in another unit, sign or time convention than the simulator's: that is told, and no effect is named."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from analysis.frequency_response import Complex, Real
from analysis.gap.effect import Given
from analysis.gap.evidence.verdict import Status
from analysis.gap.parameter import Parameter
from analysis.gap.structures.curve import Conditions, Curve
from analysis.gap.structures.diagnosis import diagnose_curves
from analysis.gap.structures.effect import Properties
from analysis.gap.structures.material_effects import PowerOfFrequency
from analysis.gap.structures.single_degree import SingleDegree
from tests.analysis.gap.structures.warm_spring import Warmth, measured, simulator, still, warm

OSCILLATOR = SingleDegree(
    (
        Parameter("stiffness", "N/m", 1.6e4, 0.02, positive=True),
        Parameter("mass", "kg", 1.0, 0.02, positive=True),
        Parameter("loss_factor", "1", 0.03, 0.3, positive=True),
    )
)


def receptance(change: Callable[[Complex], Complex]) -> list[Curve]:
    random, frequency, curves = np.random.default_rng(4), np.linspace(10.0, 35.0, 40), []
    for force in (1.0, 5.0):
        stiffness = 1.62e4 * (1 + 0.028j) - (2 * np.pi * frequency) ** 2 * 0.99
        exact = change(np.asarray(force / stiffness, dtype=complex))
        deviation = np.full(40, 0.005 * np.sqrt(np.mean(np.abs(exact) ** 2)))
        values = exact + deviation * (random.standard_normal(40) + 1j * random.standard_normal(40))
        conditions = {"frequency": frequency, "force": np.full(40, force)}
        curves.append(Curve("displacement", f"{force:g} N", values, deviation, conditions))
    return curves


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (np.conj, "fit far better when they are conjugated"),
        (lambda values: -values, "values of displacement fit far better with the opposite sign"),
        (lambda values: 1e3 * values, "when they are divided by about 1e+03"),
        (lambda values: 1e-3 * values, "when they are divided by about 0.001"),
    ],
)
def test_values_that_are_read_in_another_way_are_told_and_name_no_cause(
    change: Callable[[Complex], Complex], said: str
) -> None:
    found = diagnose_curves(OSCILLATOR, receptance(change), without=frozenset({"gain_slope", "coulomb_friction"}))
    assert (found.status, found.effects, found.confounded) == (Status.UNKNOWN, (), ())
    (sentence,) = found.does_not_fit
    assert said in sentence
    assert "no cause can be named" in sentence


def test_a_gap_of_an_effect_is_no_other_reading() -> None:
    found = diagnose_curves(simulator(), measured(lambda *at: 1.3 * warm(*at)))
    assert (found.effects, found.does_not_fit) == (("warmth",), ())
    assert diagnose_curves(simulator(), measured(still)).does_not_fit == ()


def test_an_effect_that_fits_better_than_another_unit_is_named() -> None:
    def much_softer(frequency: Real, temperature: float) -> Complex:
        return np.asarray(still(frequency, temperature) * np.exp(-0.1 * (temperature - 15)) / 2)

    class Softer(Warmth):
        own_parameters = (Parameter("per_kelvin", "1/K", 0.0, 0.03),)

        def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
            factor = np.exp(-given["per_kelvin"] * (conditions["temperature"] - 15))
            return {**properties, "k": properties["k"] * factor}

    spring = (Parameter("k", "N/m", 1e5, 0.7, positive=True), Parameter("loss", "1", 0.1, 0.3, positive=True))
    found = diagnose_curves(replace(simulator(Softer()), parameters=spring), measured(much_softer))
    assert (found.effects, found.does_not_fit) == (("warmth",), ())


def test_a_power_of_frequency_takes_away_no_more_loss_than_there_is() -> None:
    properties = {"stiffness": 1e4, "loss_factor": 0.1}
    conditions = {"frequency": np.array([5.0, 50.0])}
    law = PowerOfFrequency()
    less, none = (law.properties({"exponent": each}, properties, conditions) for each in (-0.03, -0.5))
    assert np.all(less["loss_factor"] > 0)
    assert np.all(less["loss_factor"] < 0.1)
    assert none["loss_factor"] == pytest.approx(0.0, abs=1e-12)
    assert np.all(none["stiffness"] > 0)
