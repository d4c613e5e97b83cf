from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.direct.block_scatter import FEWEST_TO_SPLIT, covariance_of_mean, variance_of_mean
from analysis.direct.dynamic_stiffness import dynamic_stiffness
from analysis.frequency_response import Complex, Real

RATE, FREQUENCY, TRUTH = 2560.0, 40.0, 2.3e6 * (1 + 0.12j)


def random_blocks(seed: int, count: int = 12) -> tuple[Complex, Real]:
    rng = np.random.default_rng(seed)
    amplitude = 1 + 0.03 * rng.standard_normal(count)
    noise = rng.standard_normal(count) + 1j * rng.standard_normal(count)
    return np.asarray((amplitude - 1) * (-3 + 1j) + 0.01 * noise), amplitude


def softening_record(rng: np.random.Generator, cycles: int) -> tuple[Real, Real]:
    """A machine whose amplitude runs straight from one cycle's value to the next one's, 2 % apart, and a specimen
    that softens by 0.4 % for each per cent; hardly any noise besides.
    """
    phase = FREQUENCY * np.arange(round(cycles * RATE / FREQUENCY)) / RATE
    wander = np.interp(phase, np.arange(cycles + 1), 0.02 * rng.standard_normal(cycles + 1))
    wave = 50e-6 * (1 + wander) * np.exp(2j * np.pi * phase)
    force = (TRUTH * (1 + wander) ** -0.4 * wave).real
    return wave.real + 1e-9 * rng.standard_normal(phase.size), force + 1e-3 * rng.standard_normal(phase.size)


@pytest.mark.parametrize("cycles", [10, 20, 70])
def test_intervals_hold_for_a_softening_specimen_on_a_wandering_machine(cycles: int) -> None:
    rng = np.random.default_rng(cycles)
    runs = 1500
    points = [dynamic_stiffness(*softening_record(rng, cycles), RATE, FREQUENCY) for _ in range(runs)]
    hits = [low <= TRUTH.real <= high for low, high in (point.stiffness_estimate.interval() for point in points)]
    # 1500 draws know 95 % to 0.6 %
    assert 0.93 < np.mean(hits) < 0.97


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), scale=st.floats(1e-6, 1e6), unit=st.floats(1e-6, 1e6), turn=st.floats(-3, 3))
def test_units_and_the_choice_of_axes_change_nothing_else(seed: int, scale: float, unit: float, turn: float) -> None:
    deviation, amplitude = random_blocks(seed)
    plain = covariance_of_mean(deviation, amplitude, 2)
    turned = covariance_of_mean(scale * deviation * np.exp(1j * turn), unit * amplitude, 2)
    axes = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    np.testing.assert_allclose(turned, scale**2 * axes @ plain @ axes.T, rtol=1e-6, atol=1e-9 * np.trace(turned))


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(2, 30), cycles=st.integers(1, 5))
def test_a_covariance_is_never_indefinite(seed: int, count: int, cycles: int) -> None:
    covariance = covariance_of_mean(*random_blocks(seed, count), cycles)
    assert np.linalg.eigvalsh(covariance)[0] >= -1e-12 * np.trace(covariance)


def test_what_does_not_follow_the_amplitude_scatters_as_independent_blocks_do() -> None:
    rng = np.random.default_rng(3)
    count, runs = 20, 4000
    found = [
        covariance_of_mean(
            rng.standard_normal(count) + 1j * rng.standard_normal(count), 1 + 0.01 * rng.standard_normal(count), 1
        )
        for _ in range(runs)
    ]
    # 4000 draws of 18 degrees of freedom know the variance to 0.5 %
    np.testing.assert_allclose(np.mean(found, axis=0), np.eye(2) / count, atol=0.02 / count)


def test_wander_of_single_cycles_counts_for_at_least_twice_the_variance_of_independent_ones() -> None:
    amplitude = np.random.default_rng(1).standard_normal(30)
    independent = float(np.var(amplitude, ddof=1)) / 30
    assert variance_of_mean(amplitude, 1) == pytest.approx(2 * independent)
    assert variance_of_mean(amplitude, 5) >= (1 + 1 / 9) * independent


def test_a_trend_counts_as_wander_however_long_the_blocks() -> None:
    trend = np.linspace(0, 1, 30)
    assert variance_of_mean(trend, 50) == pytest.approx(2 * float(np.var(trend, ddof=1)) / 30)


def test_too_few_blocks_are_all_taken_for_wander() -> None:
    deviation, amplitude = random_blocks(4, FEWEST_TO_SPLIT - 1)
    expected = 2 * np.cov(deviation.real, deviation.imag) / len(deviation)
    np.testing.assert_allclose(covariance_of_mean(deviation, amplitude, 1), expected)


def test_a_series_that_does_not_move_has_no_variance() -> None:
    assert variance_of_mean(np.ones(7), 1) == 0.0
