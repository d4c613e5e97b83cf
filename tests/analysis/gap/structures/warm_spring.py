"""A spring that is softer when warm, and its simulator: truth comes from formulas of this file."""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.effect import Given, Mechanism
from analysis.gap.parameter import Parameter
from analysis.gap.structures.callable_simulator import CallableSimulator
from analysis.gap.structures.curve import Conditions, Curve
from analysis.gap.structures.effect import Properties, StructureEffect

NOISE = 1e-3


class Warmth(StructureEffect):
    id, title, mechanism = "warmth", "softer when warm", Mechanism.JOINT_STATE
    needs = frozenset({"temperature"})
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("per_kelvin", "1/K", 0.0, 0.01),)

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        return {**properties, "k": properties["k"] * (1 - given["per_kelvin"] * (conditions["temperature"] - 20))}


class Lag(StructureEffect):
    id, title, mechanism = "lag", "read late", Mechanism.MEASURING_CHAIN
    needs = frozenset({"frequency"})
    own_parameters = (Parameter("lag", "s", 0.0, 1e-3),)

    def reading(self, given: Given, values: Complex, curve: Curve) -> Complex:
        return np.asarray(values * np.exp(-2j * np.pi * curve.conditions["frequency"] * given["lag"]))


def spring(parameters: Mapping[str, Any], conditions: Conditions) -> Complex:
    return np.asarray(parameters["k"] * (1 + 1j * parameters["loss"]) * np.ones(conditions["frequency"].size))


def simulator(*effects: StructureEffect) -> CallableSimulator:
    parameters = (Parameter("k", "N/m", 1e5, 0.1, positive=True), Parameter("loss", "1", 0.1, 0.3, positive=True))
    return CallableSimulator(spring, parameters, effects or (Warmth(), Lag()))


def measured(truth: Callable[[Real, float], Complex], seed: int = 1) -> tuple[Curve, ...]:
    random, frequency = np.random.default_rng(seed), np.linspace(10.0, 100.0, 15)
    curves = []
    for temperature in (15.0, 20.0, 25.0, 30.0):
        exact = truth(frequency, temperature)
        deviation = NOISE * np.abs(exact)
        noise = deviation * (random.standard_normal(15) + 1j * random.standard_normal(15))
        conditions = {"frequency": frequency, "temperature": np.full(15, temperature)}
        curves.append(Curve("stiffness", f"{temperature:g} degC", exact + noise, deviation, conditions))
    return tuple(curves)


def still(frequency: Real, temperature: float) -> Complex:
    del temperature
    return np.full(frequency.size, 1.04e5 * (1 + 0.12j))


def warm(frequency: Real, temperature: float) -> Complex:
    return np.asarray(still(frequency, temperature) * np.exp(-0.006 * (temperature - 20)))


def late_and_warm(frequency: Real, temperature: float) -> Complex:
    return np.asarray(warm(frequency, temperature) * np.exp(-2j * np.pi * frequency * 4e-4))


def four(*changes: float) -> list[Curve]:
    """One stiffness at each of four temperatures, off by these shares."""
    found = []
    for temperature, change in zip((15.0, 20.0, 25.0, 30.0), changes, strict=True):
        conditions = {"frequency": np.ones(1), "temperature": np.full(1, temperature)}
        found.append(
            Curve("stiffness", f"{temperature:g} degC", np.array([1e5 * (1 + change)]), np.full(1, 100.0), conditions)
        )
    return found


class Bends(Warmth):
    """Any polynomial of temperature with these many coefficients."""

    id = "bends"

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        factor = sum(each * ((conditions["temperature"] - 22) / 8) ** n for n, each in enumerate(given.values()))
        return {**properties, "k": properties["k"] * (1 + factor)}


def bends(coefficients: int) -> CallableSimulator:
    class Own(Bends):
        own_parameters = tuple(Parameter(f"a{n}", "1", 0.0, 0.3) for n in range(coefficients))

    def stiffness(parameters: Mapping[str, Any], conditions: Conditions) -> Complex:
        return np.asarray(parameters["k"] * np.ones(conditions["frequency"].size))

    return CallableSimulator(stiffness, (Parameter("k", "N/m", 1e5, 0.1, positive=True),), (Own(),))
