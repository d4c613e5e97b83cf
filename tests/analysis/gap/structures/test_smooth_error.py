"""Smooth errors of measured curves, of sensors or of the simulation: no effect is named for them."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from analysis.frequency_response import Complex, Real
from analysis.gap.effect import Given, Mechanism
from analysis.gap.evidence.verdict import Status
from analysis.gap.parameter import Parameter
from analysis.gap.structures.callable_simulator import CallableSimulator
from analysis.gap.structures.curve import Conditions, Curve
from analysis.gap.structures.diagnosis import CurveDiagnosis, diagnose_curves
from analysis.gap.structures.effect import Properties, StructureEffect
from analysis.gap.structures.likelihood import CurveLikelihood, fit_curves
from analysis.gap.structures.smooth_error import HALF_NORMAL, error_modes

COUNT = 30
Error = Callable[[np.random.Generator], Real]


class Warmth(StructureEffect):
    id, title, mechanism = "warmth", "decays faster when warm", Mechanism.JOINT_STATE
    needs, form_is_known = frozenset({"temperature"}), True
    own_parameters = (Parameter("per_kelvin", "1/K", 0.0, 0.01),)

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        faster = 1 + given["per_kelvin"] * (conditions["temperature"] - 20)
        return {**properties, "decay": properties["decay"] * faster}


class Saturation(StructureEffect):
    id, title, mechanism, form_is_known = "saturation", "the sensor saturates", Mechanism.MEASURING_CHAIN, True
    own_parameters = (Parameter("limit", "V", 20.0, 1.0, positive=True),)

    def reading(self, given: Given, values: Complex, curve: Curve) -> Complex:
        return np.asarray(values / np.sqrt(1 + (values / given["limit"]) ** 2))


class Drag(StructureEffect):
    id, title, mechanism, form_is_known = "drag", "rises with the square of speed", Mechanism.BEAM, True
    own_parameters = (Parameter("square", "s^2/m^2", 0.0, 0.05, least=0.0, starts=(0.3,)),)

    def reading(self, given: Given, values: Complex, curve: Curve) -> Complex:
        return np.asarray(values * (1 + given["square"] * curve.conditions["speed"] ** 2))


def signal(parameters: Mapping[str, Any], conditions: Conditions) -> Complex:
    place, speed = conditions["place"], conditions["speed"]
    falling = parameters["height"] * np.exp(-parameters["decay"] * place) * (1 + parameters["by_speed"] * speed)
    return np.asarray(falling + parameters["slope"] * place)


SIGNAL = CallableSimulator(
    signal,
    (
        Parameter("height", "V", 5.0, 0.1, positive=True),
        Parameter("decay", "1/m", 0.8, 0.1, positive=True),
        Parameter("by_speed", "s/m", 0.1, 0.02),
        Parameter("slope", "V/m", 0.3, 0.1),
    ),
    (Warmth(), Saturation(), Drag()),
)


def half_waves(random: np.random.Generator) -> Real:
    phase = np.linspace(0.0, np.pi, COUNT)
    return np.asarray(sum(random.standard_normal() * np.cos(order * phase) for order in range(4)) / 2)


def gaussian_process(random: np.random.Generator) -> Real:
    place = np.linspace(0.0, 1.0, COUNT)
    covariance = np.exp(-(((place[:, None] - place) / 0.25) ** 2) / 2) + 1e-9 * np.eye(COUNT)
    return np.asarray(np.linalg.cholesky(covariance) @ random.standard_normal(COUNT))


def no_error(random: np.random.Generator) -> Real:
    return np.zeros(COUNT)


def measured(seed: int, per_kelvin: float, error: Error) -> list[Curve]:
    random, curves = np.random.default_rng(seed), []
    given = {"height": 5.2, "decay": 0.76, "by_speed": 0.11, "slope": 0.32}
    for run in range(4):
        place = np.sort(random.uniform(0, 4, COUNT))
        warm = 20 + 8.0 * run + random.uniform(-2, 2, COUNT)
        conditions = {"place": place, "temperature": warm, "speed": random.uniform(0, 3, COUNT)}
        exact = signal({**given, "decay": 0.76 * (1 + per_kelvin * (warm - 20))}, conditions)
        deviation = np.full(COUNT, 0.004 * np.sqrt(np.mean(exact**2)))
        values = exact * (1 + 0.003 * error(random)) + deviation * random.standard_normal(COUNT)
        curves.append(Curve("u", f"run {run}", values, deviation, conditions))
    return curves


def diagnosed(seed: int, per_kelvin: float, error: Error) -> CurveDiagnosis:
    return diagnose_curves(SIGNAL, measured(seed, per_kelvin, error))


@pytest.mark.parametrize("error", [half_waves, gaussian_process])
def test_no_effect_is_named_for_smooth_errors(error: Error) -> None:
    found = [diagnosed(seed, 0.0, error) for seed in range(8)]
    assert [each.status for each in found].count(Status.NONE) >= 7


@pytest.mark.parametrize(("error", "most"), [(no_error, 0.2 * HALF_NORMAL), (half_waves, HALF_NORMAL)])
def test_intervals_hold_with_and_without_smooth_errors(error: Error, most: float) -> None:
    inside, scales = 0, []
    for seed in range(8):
        found = diagnosed(seed, 0.006, error)
        assert found.effects == ("warmth",)
        low, high = found.ranking[0].parameters["warmth"]["per_kelvin"].ci90
        inside += low < 0.006 < high
        scales.append(found.model.fit.likelihood.smooth_error)
    assert inside >= 6
    assert np.median(scales) <= most
    assert error is no_error or np.median(scales) >= 0.2 * HALF_NORMAL


@pytest.mark.parametrize("is_complex", [False, True])
def test_smooth_errors_are_marginalised_as_their_covariance_says(is_complex: bool) -> None:
    random = np.random.default_rng(3)
    real, imaginary, deviation = random.standard_normal((3, COUNT))
    values = real + 1j * imaginary if is_complex else real
    curve = Curve("u", "a", values, np.where(np.arange(COUNT) == 4, np.inf, np.abs(deviation) + 0.1), {})
    modes, scale = error_modes(curve), 0.7
    covariance = np.eye(curve.data) + scale**2 * (modes.shapes * modes.power) @ modes.shapes.T
    left = random.standard_normal(curve.data)
    whitened = modes.whitened(left, scale)
    assert whitened @ whitened == pytest.approx(left @ np.linalg.solve(covariance, left))
    assert modes.log_determinant(scale) == pytest.approx(np.linalg.slogdet(covariance)[1])


def test_a_smooth_error_has_its_scale_as_root_mean_square() -> None:
    curve = Curve("u", "a", np.full(COUNT, 7.0), np.full(COUNT, 0.1), {})
    modes = error_modes(curve)
    variance = np.diag((modes.shapes * modes.power) @ modes.shapes.T) * 0.1**2
    assert np.mean(variance) == pytest.approx(7.0**2)


def test_a_single_value_has_no_smooth_error() -> None:
    curve = Curve("u", "a", np.ones(1), np.full(1, 0.1), {})
    assert error_modes(curve).power.size == 0
    assert np.array_equal(error_modes(curve).whitened(np.ones(1), HALF_NORMAL), np.ones(1))


def test_evidence_falls_for_errors_that_are_not_there() -> None:
    def evidence(scale: float, error: Error) -> float:
        likelihood = CurveLikelihood(SIGNAL, (), tuple(measured(1, 0.0, error)), smooth_error=scale)
        found = fit_curves(likelihood, np.zeros(likelihood.unknowns))
        return float(-(found.at.cost + np.linalg.slogdet(found.at.normal)[1]) / 2 + likelihood.log_normalisation)

    assert evidence(0.0, no_error) > evidence(HALF_NORMAL, no_error)
    assert evidence(0.0, half_waves) < evidence(HALF_NORMAL, half_waves)
