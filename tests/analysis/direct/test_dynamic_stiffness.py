import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from analysis.direct.dynamic_stiffness import LARGEST_DISTORTION, dynamic_stiffness
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.interval import Estimate
from tests.analysis.direct.points import from_polar

RATE = 2560.0
TRUTH = 2.3e6 * (1 + 0.12j)


def steady(frequency: float = 50.0, cycles: int = 25, stiffness: complex = TRUTH) -> tuple[Real, Real]:
    """Displacement (50 um peak) and force of an exactly linear specimen."""
    wave = 50e-6 * np.exp(2j * np.pi * frequency * np.arange(round(cycles * RATE / frequency)) / RATE)
    return wave.real, (stiffness * wave).real


def noisy(rng: np.random.Generator, frequency: float, cycles: int = 24) -> tuple[Real, Real]:
    """A machine whose amplitude and phase wander by 2 % over about a cycle, and sensors with 2 % and 1 % of noise."""
    samples = round(cycles * RATE / frequency)
    memory = math.exp(-frequency / RATE)
    white = rng.standard_normal((2, samples + 400))
    slow = lfilter([math.sqrt(1 - memory**2)], [1, -memory], white)[:, 400:]
    wave = 5e-6 * (1 + 0.02 * (slow[0] + 1j * slow[1])) * np.exp(2j * np.pi * frequency * np.arange(samples) / RATE)
    sensor = rng.standard_normal((2, samples))
    return wave.real + 1e-7 * sensor[0], (TRUTH * wave).real + 0.05e-6 * abs(TRUTH) * sensor[1]


def test_an_exact_record_gives_its_stiffness_damping_and_energy() -> None:
    point = dynamic_stiffness(*steady(), RATE, 50.0)
    assert point.stiffness == pytest.approx(2.3e6, rel=1e-9)
    assert point.damping == pytest.approx(0.276e6, rel=1e-9)
    assert point.loss_factor == pytest.approx(0.12, rel=1e-9)
    assert point.magnitude == pytest.approx(abs(TRUTH), rel=1e-9)
    assert point.loss_angle == pytest.approx(math.atan(0.12), rel=1e-9)
    assert point.amplitude_pp == pytest.approx(1e-4, rel=1e-9)
    assert point.loop_energy == pytest.approx(math.pi * 50e-6**2 * 0.276e6, rel=1e-9)
    assert point.first_harmonic_energy == pytest.approx(point.loop_energy, rel=1e-9)
    assert point.first_harmonic_sufficient


@pytest.mark.parametrize("frequency", [20.0, 45.0, 200.0])
def test_intervals_of_a_noisy_machine_cover_the_truth_as_often_as_they_say(frequency: float) -> None:
    rng = np.random.default_rng(round(frequency))
    runs = 2000
    hits = np.zeros(5)
    for _ in range(runs):
        point = dynamic_stiffness(*noisy(rng, frequency), RATE, frequency)
        estimates = (
            (point.stiffness_estimate, TRUTH.real),
            (point.damping_estimate, TRUTH.imag),
            (point.loss_factor_estimate, 0.12),
            (point.magnitude_estimate, abs(TRUTH)),
            (point.loss_angle_estimate, math.atan(0.12)),
        )
        for index, (estimate, truth) in enumerate(estimates):
            low, high = estimate.interval()
            hits[index] += low <= truth <= high
    # 2000 draws know 95 % to 0.5 %
    assert np.all((hits / runs > 0.93) & (hits / runs < 0.97)), hits / runs


def test_an_amplitude_that_wanders_costs_the_stiffness_nothing_when_the_force_follows() -> None:
    rng = np.random.default_rng(2)
    _, force = steady()
    slow = 1 + 0.03 * np.cumsum(rng.standard_normal(force.size)) / math.sqrt(force.size)
    wave = slow * 50e-6 * np.exp(2j * np.pi * 50 * np.arange(force.size) / RATE)
    point = dynamic_stiffness(wave.real, (TRUTH * wave).real, RATE, 50.0)
    assert point.amplitude_pp_standard_error is not None
    assert point.amplitude_pp_standard_error / point.amplitude_pp > 1e-3
    assert point.magnitude_estimate.standard_error / point.magnitude < 1e-4
    assert point.magnitude == pytest.approx(abs(TRUTH), rel=1e-4)


@settings(max_examples=40, deadline=None)
@given(of_displacement=st.floats(1e-6, 1e6), of_force=st.floats(1e-6, 1e6), seed=st.integers(0, 99))
def test_units_scale_stiffness_and_errors_and_leave_loss_factor_and_verdict(
    of_displacement: float, of_force: float, seed: int
) -> None:
    x, f = noisy(np.random.default_rng(seed), 50.0)
    plain = dynamic_stiffness(x, f, RATE, 50.0)
    scaled = dynamic_stiffness(of_displacement * x, of_force * f, RATE, 50.0)
    ratio = of_force / of_displacement
    assert scaled.complex_stiffness == pytest.approx(ratio * plain.complex_stiffness, rel=1e-7)
    np.testing.assert_allclose(scaled.covariance, ratio**2 * plain.covariance, rtol=1e-4, atol=0)
    assert scaled.loss_factor_estimate.standard_error == pytest.approx(
        plain.loss_factor_estimate.standard_error, rel=1e-4
    )
    assert scaled.loop_energy == pytest.approx(of_force * of_displacement * (plain.loop_energy or 0.0), rel=1e-6)
    assert scaled.first_harmonic_sufficient == plain.first_harmonic_sufficient


@settings(max_examples=40, deadline=None)
@given(start=st.integers(0, 1000), third=st.floats(0.0, 0.3))
def test_where_a_steady_record_starts_does_not_matter(start: int, third: float) -> None:
    time = np.arange(1280) / RATE
    later = time + start / RATE

    def at(moment: Real) -> tuple[Real, Real]:
        wave = 50e-6 * np.exp(2j * np.pi * 50 * moment)
        return wave.real, (TRUTH * wave + third * abs(TRUTH) * 50e-6 * np.exp(6j * np.pi * 50 * moment)).real

    here, there = (dynamic_stiffness(*at(moment), RATE, 50.0) for moment in (time, later))
    assert there.complex_stiffness == pytest.approx(here.complex_stiffness, rel=1e-8)
    assert there.thd_force == pytest.approx(third / 1.0, rel=1e-6, abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(first=st.complex_numbers(min_magnitude=1e4, max_magnitude=1e7), second=st.floats(1e4, 1e7))
def test_specimens_side_by_side_add_their_stiffness_and_their_energy(first: complex, second: float) -> None:
    x, one = steady(stiffness=first)
    _, other = steady(stiffness=complex(second, second / 10))
    parts = [dynamic_stiffness(x, force, RATE, 50.0) for force in (one, other)]
    both = dynamic_stiffness(x, one + other, RATE, 50.0) if abs(first + second) > 1e3 else None
    if both is not None:
        assert both.complex_stiffness == pytest.approx(sum(part.complex_stiffness for part in parts), rel=1e-7)
        scale = 1e-9 * (abs(first) + second) * 50e-6**2
        assert both.loop_energy == pytest.approx(sum(part.loop_energy or 0.0 for part in parts), rel=1e-7, abs=scale)


def test_a_distorted_force_is_flagged_with_its_figure() -> None:
    x, f = steady()
    third = 0.15 * abs(TRUTH) * 50e-6 * np.cos(2 * np.pi * 150 * np.arange(x.size) / RATE)
    point = dynamic_stiffness(x, f + third, RATE, 50.0)
    assert not point.first_harmonic_sufficient
    assert point.shortcomings == ("total harmonic distortion of the force is 15.0 %, above 10 %",)


def with_third(rng: np.random.Generator, frequency: float) -> tuple[Real, Real]:
    """A noisy machine with 8 % of third harmonic in the force and 4 % in the displacement."""
    x, f = noisy(rng, frequency)
    angle = 6 * np.pi * frequency * np.arange(x.size) / RATE
    return x + 0.04 * 5e-6 * np.cos(angle + 2.0), f + 0.08 * 5e-6 * abs(TRUTH) * np.cos(angle + 0.4)


def test_intervals_of_distortion_and_energy_cover_the_truth() -> None:
    rng = np.random.default_rng(1)
    energy = math.pi * 5e-6**2 * TRUTH.imag
    extra = 3 * math.pi * 0.04 * 0.08 * 5e-6**2 * abs(TRUTH) * math.sin(0.4 - 2.0)
    runs = 600
    hits = np.zeros(4)
    for _ in range(runs):
        point = dynamic_stiffness(*with_third(rng, 45.0), RATE, 45.0)
        assert point.thd_force is not None
        assert point.thd_force_standard_error is not None
        assert point.thd_displacement is not None
        assert point.thd_displacement_standard_error is not None
        assert point.loop_energy_estimate is not None
        assert point.loop_energy_excess is not None
        freedom = point.degrees_of_freedom
        estimates = (
            (Estimate(point.thd_force, point.thd_force_standard_error, freedom), 0.08),
            (Estimate(point.thd_displacement, point.thd_displacement_standard_error, freedom), 0.04),
            (point.loop_energy_estimate, energy + extra),
            (point.loop_energy_excess, extra),
        )
        for index, (estimate, truth) in enumerate(estimates):
            low, high = estimate.interval()
            hits[index] += low <= truth <= high
    # 600 draws know 95 % to 0.9 %; the error of the excess counts all scatter as wander, and is wide
    assert np.all(hits / runs > 0.92), hits / runs
    assert np.all(hits[:3] / runs < 0.99), hits / runs


def test_the_error_of_a_distortion_falls_with_the_length_of_the_record() -> None:
    rng = np.random.default_rng(4)

    def error(cycles: int) -> float:
        x, f = noisy(rng, 50.0, cycles)
        third = 0.1 * 5e-6 * abs(TRUTH) * np.cos(300 * np.pi * np.arange(x.size) / RATE)
        found = dynamic_stiffness(x, f + third, RATE, 50.0).thd_force_standard_error
        assert found is not None
        return found

    short, long = (np.mean([error(cycles) for _ in range(40)]) for cycles in (24, 216))
    assert short / long == pytest.approx(3, rel=0.25)


def test_distortion_just_below_the_limit_passes() -> None:
    x, f = steady()
    third = 0.99 * LARGEST_DISTORTION * abs(TRUTH) * 50e-6 * np.cos(2 * np.pi * 150 * np.arange(x.size) / RATE)
    assert dynamic_stiffness(x, f + third, RATE, 50.0).first_harmonic_sufficient


def test_a_loop_whose_harmonics_hold_energy_is_flagged() -> None:
    x, f = steady()
    angle = 2 * np.pi * 150 * np.arange(x.size) / RATE
    # 5 % of third harmonic in both, a quarter of a turn apart: energy 3 pi |X3| |F3| beside pi X^2 h
    point = dynamic_stiffness(
        x + 0.05 * 50e-6 * np.cos(angle), f - 0.05 * abs(TRUTH) * 50e-6 * np.sin(angle), RATE, 50.0
    )
    extra = 3 * math.pi * (0.05 * 50e-6) ** 2 * abs(TRUTH)
    assert point.loop_energy == pytest.approx(point.first_harmonic_energy + extra, rel=1e-6)
    assert len(point.shortcomings) == 1
    assert "the loop holds" in point.shortcomings[0]


def test_a_lossless_spring_is_not_flagged_for_having_no_energy() -> None:
    assert dynamic_stiffness(*steady(stiffness=2e6 + 0j), RATE, 50.0).first_harmonic_sufficient


def test_a_displacement_lost_in_noise_is_refused() -> None:
    x, f = steady()
    noise = np.random.default_rng(0).standard_normal(x.size)
    with pytest.raises(AnalysisError, match="lost in noise"):
        dynamic_stiffness(0.01 * x + 50e-6 * noise, f, RATE, 50.0)


def test_a_dead_channel_is_named() -> None:
    x, f = steady()
    with pytest.raises(AnalysisError, match="force is constant at 0"):
        dynamic_stiffness(x, 0 * f, RATE, 50.0)


def test_records_of_unequal_length_are_refused() -> None:
    x, f = steady()
    with pytest.raises(AnalysisError, match="shapes"):
        dynamic_stiffness(x, f[1:], RATE, 50.0)


def test_a_point_of_a_bundle_has_the_errors_that_its_relative_deviation_says() -> None:
    point = from_polar(50.0, 1e-5, 2e6, math.radians(7), 0.01)
    assert point.magnitude_estimate.standard_error == pytest.approx(2e4)
    assert point.loss_angle_estimate.standard_error == pytest.approx(0.01)
    low, high = point.magnitude_estimate.interval()
    assert (high - low) / 2 == pytest.approx(1.959964 * 2e4)
    assert point.loop_energy is None
    assert point.loop_energy_estimate is None
    assert point.thd_force_standard_error is None


def test_an_interval_of_few_blocks_is_wider_by_students_factor() -> None:
    assert Estimate(0.0, 1.0, 1).half_width() == pytest.approx(12.706, abs=1e-3)
    assert Estimate(0.0, 1.0).half_width() == pytest.approx(1.960, abs=1e-3)


def test_the_loss_angle_of_next_to_no_damping_is_a_number() -> None:
    point = from_polar(50.0, 1e-5, 2e6, 5e-324, 0.01)
    assert point.loss_angle == pytest.approx(0.0, abs=1e-300)
