"""Clipped records have a remark, and records of a coarse converter have none."""

import math

import numpy as np
import pytest

from analysis.direct.dynamic_stiffness import SATURATED, dynamic_stiffness
from analysis.frequency_response import Real

RATE, CYCLES = 5000.0, 24
AMPLITUDE, STIFFNESS = 1e-5, 1e6 * (1 + 0.1j)
PEAK = AMPLITUDE * abs(STIFFNESS)


def records(frequency: float, noise: float, seed: int = 1) -> tuple[Real, Real]:
    """Displacement in m and force in N."""
    rng = np.random.default_rng(seed)
    angle = 2 * math.pi * frequency * np.arange(int(CYCLES * RATE / frequency)) / RATE + rng.uniform(0, 2 * math.pi)
    displacement = AMPLITUDE * (np.cos(angle) + noise * rng.normal(size=angle.size))
    force = (AMPLITUDE * STIFFNESS * np.exp(1j * angle)).real + PEAK * noise * rng.normal(size=angle.size)
    return displacement, force


def rounded(signal: Real, step: float) -> Real:
    return np.asarray(np.round(signal / step) * step)


@pytest.mark.parametrize("noise", [1e-4, 1e-2])
@pytest.mark.parametrize("frequency", [7.3, 40.0, 187.0])
@pytest.mark.parametrize("limit", [0.9, 0.98, 0.99])
def test_a_clipped_force_is_called_saturated(frequency: float, noise: float, limit: float) -> None:
    displacement, force = records(frequency, noise)
    point = dynamic_stiffness(displacement, np.clip(force, -limit * PEAK, limit * PEAK), RATE, frequency)
    (remark,) = (each for each in point.shortcomings if each.startswith(SATURATED))
    assert remark.startswith("saturated force: ")
    assert "lower the amplitude" in remark


def test_one_limit_is_enough_and_a_converter_of_16_bit_does_not_hide_it() -> None:
    displacement, force = records(40.0, 1e-3)
    clipped = rounded(np.maximum(displacement, -0.97 * AMPLITUDE), AMPLITUDE / 2**15)
    (remark,) = dynamic_stiffness(clipped, force, RATE, 40.0).shortcomings
    assert remark.startswith("saturated displacement: ")
    assert "at its minimum" in remark


@pytest.mark.parametrize("steps", [4, 20, 300, 2**15])
@pytest.mark.parametrize("noise", [0.0, 1e-3, 3e-2])
@pytest.mark.parametrize("frequency", [7.3, 40.0, 50.0, 187.0])
def test_rounding_of_a_converter_is_not_saturation(frequency: float, noise: float, steps: int) -> None:
    displacement, force = records(frequency, noise)
    point = dynamic_stiffness(rounded(displacement, AMPLITUDE / steps), rounded(force, PEAK / steps), RATE, frequency)
    assert not [each for each in point.shortcomings if each.startswith(SATURATED)]


def test_an_unclipped_sine_without_noise_is_clean() -> None:
    for frequency in (10.0, 50.0, 123.4):
        assert dynamic_stiffness(*records(frequency, 0.0), RATE, frequency).first_harmonic_sufficient
