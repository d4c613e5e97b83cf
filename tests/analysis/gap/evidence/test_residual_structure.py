"""Misfit is distinguished from noise without having to know how large the noise is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.frequency_response import Complex
from analysis.gap.evidence.residual_structure import (
    Misfit,
    energy_of,
    lines_with_common_noise,
    misfit_of,
    series,
)
from analysis.gap.measurement import Measurement

LINES = 200
SEEDS = 400


def white(seed: int, size: int = LINES) -> Complex:
    """(size,) noise of unit variance per part."""
    random = np.random.default_rng(seed)
    return np.asarray(random.standard_normal(size) + 1j * random.standard_normal(size), dtype=np.complex128)


@pytest.mark.parametrize("level", [0.3, 1.0, 5.0])
def test_energy_of_noise_scatters_about_zero_as_its_deviation_says(level: float) -> None:
    found = np.array([energy_of(np.asarray(level * white(seed))) for seed in range(SEEDS)])
    scores = found[:, 0] / found[:, 1]
    assert abs(np.mean(scores)) < 4 / np.sqrt(SEEDS)
    assert np.std(scores) == pytest.approx(1.0, abs=4 / np.sqrt(2 * SEEDS))


def test_energy_of_a_smooth_misfit_is_its_sum_of_squares() -> None:
    place = np.linspace(0.0, 1.0, LINES)
    smooth = 3 * np.exp(2j * np.pi * place) + place
    total = float(np.sum(np.abs(smooth) ** 2))
    assert energy_of(smooth)[0] == pytest.approx(total, rel=0.01)
    under_noise = [energy_of(smooth + white(seed))[0] for seed in range(SEEDS)]
    assert np.mean(under_noise) == pytest.approx(total, rel=0.02)


def windowed(seed: int, decay: float) -> Complex:
    """(LINES,) noise of records under a window that falls to e^-decay within them, of unit variance per part."""
    window = np.exp(-decay * (np.arange(LINES) + 0.5) / LINES)
    spectrum = np.fft.fft(white(seed) * window)
    return np.asarray(spectrum / np.sqrt(np.sum(window**2)))


@pytest.mark.parametrize("decay", [0.3, 2.0, 8.0])
def test_noise_under_an_exponential_window_is_no_misfit(decay: float) -> None:
    found = np.array([energy_of(windowed(seed, decay), decay) for seed in range(SEEDS)])
    scores = found[:, 0] / found[:, 1]
    assert abs(np.mean(scores)) < 4 / np.sqrt(SEEDS)
    # squares of the few instants that count scatter more than those of normal values
    assert np.std(scores) == pytest.approx(1.0, abs=8 / np.sqrt(2 * SEEDS))


def test_a_misfit_under_an_exponential_window_keeps_its_energy() -> None:
    smooth = np.full(LINES, 3 + 1j)
    under_noise = [energy_of(smooth + windowed(seed, 4.0), 4.0)[0] for seed in range(SEEDS)]
    assert np.mean(under_noise) == pytest.approx(float(np.sum(np.abs(smooth) ** 2)), rel=0.05)


@pytest.mark.parametrize("decay", [0.0, 0.5, 3.0, 9.0])
def test_lines_have_as_much_noise_in_common_as_their_correlations_say(decay: float) -> None:
    lags = np.arange(-100000, 100001)
    correlation = decay / (decay + 1j * np.pi * lags) if decay else (lags == 0).astype(complex)
    assert lines_with_common_noise(decay) == pytest.approx(float(np.sum(np.abs(correlation) ** 2)), rel=1e-4)


@given(st.integers(0, 10**6), st.floats(0.01, 100.0))
def test_energy_and_deviation_scale_with_the_square(seed: int, factor: float) -> None:
    once, scaled = energy_of(white(seed, 20)), energy_of(np.asarray(factor * white(seed, 20)))
    assert scaled == pytest.approx((factor**2 * once[0], factor**2 * once[1]), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("size", range(2, 9))
@pytest.mark.parametrize("is_real", [False, True])
def test_the_energy_of_few_values_of_noise_scatters_as_its_deviation_says(size: int, is_real: bool) -> None:
    drawn = [white(seed, size) for seed in range(10 * SEEDS)]
    found = np.array([energy_of(each.real if is_real else each) for each in drawn])
    scores = found[:, 0] / found[:, 1]
    assert abs(np.mean(scores)) < 4 / np.sqrt(scores.size)
    assert np.std(scores) == pytest.approx(1.0, abs=4 / np.sqrt(2 * scores.size))


@pytest.mark.parametrize("decay", [0.0, 0.4])
@pytest.mark.parametrize("size", [2, 3, 5, 60])
def test_the_deviation_of_an_energy_is_that_of_its_quadratic_form(size: int, decay: float) -> None:
    columns = np.eye(size, dtype=complex)
    lags = np.subtract.outer(np.arange(size), np.arange(size))
    noise = decay / (decay + 1j * np.pi * lags) if decay else columns
    of_one = [energy_of(each, decay)[0] for each in columns]
    pairs = [[energy_of(a + b, decay)[0] - x - y for b, y in zip(columns, of_one, strict=True)]
             for a, x in zip(columns, of_one, strict=True)]  # fmt: skip
    form = np.array(pairs) / 2  # symmetric, and real as the lags are
    np.fill_diagonal(form, of_one)
    once, square = form @ noise, np.trace(noise @ noise).real
    expected = np.sqrt(np.trace(once @ once).real / (size**2 + square))
    residual = white(3, size)
    assert energy_of(residual, decay)[1] == pytest.approx(expected * float(np.vdot(residual, residual).real))


def test_the_misfit_of_few_real_values_is_that_of_neighbours() -> None:
    found = misfit_of([np.array([5.0, 5.0, 5.0])])
    assert found.energy == pytest.approx(75.0)
    assert found.excess == pytest.approx(75.0 - 2 * 3)


@pytest.mark.parametrize("size", [1, 2, 3])
def test_few_lines_have_an_energy_with_a_deviation(size: int) -> None:
    energy, deviation = energy_of(white(1, size))
    assert np.isfinite(energy)
    assert deviation > 0
    if size == 1:
        assert energy == 0.0


def test_only_what_exceeds_three_deviations_is_certain() -> None:
    assert Misfit(20.0, 10.0, -5.0).certain == 0.0
    assert Misfit(50.0, 10.0, -5.0).certain == pytest.approx(20.0)
    assert Misfit(0.0, 10.0, 70.0).certain == 70.0


def test_series_of_the_tester_rise_in_frequency_and_hold_every_point_once(empty: Measurement) -> None:
    points = empty.points
    assert points is not None
    found = series(points)
    assert len(found) == 2 * 3 * 3
    for (specimen, configuration, amplitude), members in found.items():
        assert np.all(np.diff(points.frequency[members]) > 0)
        assert np.all(points.specimen[members] == specimen)
        assert np.all(points.configuration[members] == configuration)
        assert np.all(points.amplitude[members] == np.unique(points.amplitude)[amplitude])
    assert sorted(np.concatenate(list(found.values()))) == list(range(points.order.size))
