import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.direct.dynamic_stiffness import dynamic_stiffness
from analysis.direct.sine import FEWEST_TO_SPLIT, covariance_of_mean, fit_sine, variance_of_mean
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real

RATE = 2560.0


def times(samples: int = 1024) -> Real:
    return np.arange(samples) / RATE


def sine(frequency: float, amplitude: complex, time: Real) -> Real:
    return np.real(amplitude * np.exp(2j * np.pi * frequency * time))


@settings(max_examples=60, deadline=None)
@given(
    frequency=st.floats(8.0, 1100.0),
    offset=st.floats(-0.35, 0.35),
    phase=st.floats(-np.pi, np.pi),
    third=st.floats(0.0, 0.3),
)
def test_an_exact_sine_is_found_exactly_from_a_third_of_a_cycle_off(
    frequency: float, offset: float, phase: float, third: float
) -> None:
    t = times()
    truth = 3e-6 * np.exp(1j * phase)
    signal = sine(frequency, truth, t) + 1e-6 + 2e-6 * t
    if 3 * frequency < RATE / 2 - 5:
        signal = signal + sine(3 * frequency, third * 3e-6, t)
    fit = fit_sine(signal, RATE, frequency + offset * RATE / t.size)
    assert fit.frequency == pytest.approx(frequency, rel=1e-8)
    assert fit.first[0] == pytest.approx(truth, rel=1e-6)


def test_the_convention_is_the_real_part_of_amplitude_times_positive_exponential_from_the_first_sample() -> None:
    t = times()
    fit = fit_sine(2 * np.cos(2 * np.pi * 50 * t + 0.7), RATE, 50.0)
    assert fit.first[0] == pytest.approx(2 * np.exp(0.7j))
    assert fit.amplitude_pp[0] == pytest.approx(4.0)


@settings(max_examples=40, deadline=None)
@given(scale=st.floats(1e-9, 1e9), seed=st.integers(0, 1000))
def test_changing_a_unit_scales_its_amplitude_and_leaves_frequency_and_the_other_signal(
    scale: float, seed: int
) -> None:
    noise = np.random.default_rng(seed).standard_normal((2, 1024))
    record = np.stack([sine(51.3, 2.0, times()), sine(51.3, 1j, times())]) + 0.05 * noise
    plain = fit_sine(record, RATE, 51.0)
    scaled = fit_sine(record * np.array([[scale], [1.0]]), RATE, 51.0)
    assert scaled.frequency == pytest.approx(plain.frequency, rel=1e-9)
    np.testing.assert_allclose(scaled.first, plain.first * [scale, 1.0], rtol=1e-6)
    np.testing.assert_allclose(scaled.amplitude_scatter, plain.amplitude_scatter, rtol=1e-5)


@settings(max_examples=40, deadline=None)
@given(start=st.integers(0, 5000), seed=st.integers(0, 1000))
def test_starting_the_clock_later_turns_the_phase_and_nothing_else(start: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    noise = 0.05 * rng.standard_normal(1024)
    now = fit_sine(sine(51.3, 2.0, times()) + noise, RATE, 51.3)
    later = fit_sine(sine(51.3, 2.0, times() + start / RATE) + noise, RATE, 51.3)
    turn = np.exp(2j * np.pi * 51.3 * start / RATE)
    # the noise is not shifted, so agreement is to within a few of its standard errors
    assert abs(later.first[0] / turn - now.first[0]) < 12 * now.residual_standard_error[0]
    assert later.amplitude_pp[0] == pytest.approx(now.amplitude_pp[0], rel=0.02)


def test_harmonics_beyond_nyquist_are_left_out() -> None:
    fit = fit_sine(sine(500.0, 1.0, times()), RATE, 500.0, harmonics=5)
    assert fit.harmonics.shape == (1, 2)


def test_distortion_is_the_root_sum_of_squares_of_the_higher_harmonics() -> None:
    t = times()
    fit = fit_sine(sine(50, 2.0, t) + sine(100, 0.3j, t) + sine(150, 0.4, t), RATE, 50.0)
    assert fit.total_harmonic_distortion[0] == pytest.approx(0.25)


def test_blocks_move_the_distortion_by_as_much_as_their_harmonics_differ() -> None:
    t = times(2048)
    grows = 1 + 0.1 * (t - np.mean(t)) / np.max(t)
    fit = fit_sine(sine(40, 2.0, t) + grows * sine(120, 0.5, t), RATE, 40.0)
    middle = np.mean(np.reshape(t, (16, -1)), axis=1)
    moved = 0.25 * 0.1 * (middle - np.mean(t)) / np.max(t)
    np.testing.assert_allclose(fit.distortion_deviation[:, 0], moved, atol=2e-4)


def test_a_pure_sine_has_blocks_that_move_its_distortion_by_nothing() -> None:
    fit = fit_sine(sine(500.0, 1.0, times()), RATE, 500.0, harmonics=1)
    assert np.all(fit.distortion_deviation == 0)


def test_a_held_frequency_stays() -> None:
    fit = fit_sine(sine(50.2, 1.0, times()), RATE, 50.0, refine=False)
    assert fit.frequency == 50.0


def test_quadratic_drift_is_taken_out_when_asked_for() -> None:
    t = times()
    fit = fit_sine(sine(50.0, 1.0, t) + 5 * t - 40 * t**2, RATE, 50.0, drift_order=2)
    assert fit.first[0] == pytest.approx(1.0)
    assert np.sqrt(np.mean(fit.residual**2)) < 1e-9


def test_errors_of_white_noise_are_those_of_the_cramer_rao_bound() -> None:
    rng = np.random.default_rng(7)
    t = times(512)
    fits = [fit_sine(sine(60.0, 1.0, t) + 0.1 * rng.standard_normal(t.size), RATE, 60.0) for _ in range(600)]
    amplitudes = np.array([abs(fit.first[0]) for fit in fits])
    frequencies = np.array([fit.frequency for fit in fits])
    # 600 draws know a standard deviation to 3 %; three of those are allowed
    bound = 0.1 * np.sqrt(2 / t.size)
    assert np.std(amplitudes) == pytest.approx(bound, rel=0.09)
    assert np.mean([fit.residual_standard_error[0] for fit in fits]) == pytest.approx(bound, rel=0.03)
    assert np.mean([fit.amplitude_pp_standard_error[0] / 2 for fit in fits]) == pytest.approx(bound, rel=0.09)
    frequency_bound = np.sqrt(6 * 0.1**2 / t.size) / (np.pi * t.size / RATE)
    assert np.std(frequencies) == pytest.approx(frequency_bound, rel=0.09)


def test_a_wandering_amplitude_shows_in_the_scatter_of_the_blocks_and_not_in_the_white_noise_error() -> None:
    rng = np.random.default_rng(3)
    cycle = np.floor(times(2048) * 40 + 1e-9).astype(int)
    wander = 1 + 0.05 * rng.standard_normal(cycle[-1] + 1)
    fit = fit_sine(wander[cycle] * sine(40.0, 1.0, times(2048)), RATE, 40.0)
    assert fit.cycles_per_block == 2
    assert len(fit.blocks) == 16
    # 16 blocks know a standard deviation to 18 %
    assert fit.amplitude_scatter[0] == pytest.approx(0.05 / np.sqrt(2), rel=0.5)
    assert fit.amplitude_pp_standard_error[0] > 3 * fit.residual_standard_error[0]


@pytest.mark.parametrize(
    ("signal", "frequency", "said"),
    [
        (sine(50.0, 1.0, times(90)), 50.0, "1.76 cycles"),
        (sine(50.0, 1.0, times()), 1300.0, "Nyquist"),
        (sine(50.0, 1.0, times()), -5.0, "not between 0"),
        (np.where(np.arange(1024) == 700, np.nan, 1.0), 50.0, "at sample 700"),
        (np.full(1024, 0.3), 50.0, "constant at 0.3"),
        (np.random.default_rng(0).standard_normal(12), 1000.0, "too few"),
        (np.zeros((2, 2, 2)), 50.0, "shape"),
        (np.zeros(0), 50.0, "shape"),
    ],
)
def test_a_record_that_cannot_be_fitted_is_refused_with_the_reason(signal: Real, frequency: float, said: str) -> None:
    with pytest.raises(AnalysisError, match=said):
        fit_sine(signal, RATE, frequency)


def test_a_sine_far_from_the_given_frequency_is_not_taken_for_it() -> None:
    t = times()
    with pytest.raises(AnalysisError, match="no sine found near"):
        fit_sine(sine(51.7, 1.0, t), RATE, 50.0)


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
    runs = 300
    points = [dynamic_stiffness(*softening_record(rng, cycles), RATE, FREQUENCY) for _ in range(runs)]
    truth = np.array([TRUTH.real * (point.amplitude_pp / 1e-4) ** -0.4 for point in points])
    estimates = [point.stiffness_estimate for point in points]
    hits = [low <= true <= high for (low, high), true in zip((e.interval() for e in estimates), truth, strict=True)]
    assert np.mean(hits) > 0.94
    # the intervals are not wider than twice what they have to be; those of the amplitude without wander were 60 times
    errors = np.array([e.value for e in estimates]) - truth
    assert np.median([e.standard_error for e in estimates]) < 2.2 * np.std(errors)
    slopes = np.array([point.amplitude_slope for point in points]) / TRUTH
    assert np.mean(slopes) == pytest.approx(-0.4, abs=0.01)


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
