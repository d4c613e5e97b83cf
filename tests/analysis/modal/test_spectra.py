"""Accelerances averaged from synthetic blows on a system of one mode, whose response is known in closed form."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, FrequencyResponses, Real
from analysis.modal.estimator import Estimator
from analysis.modal.spectra import Windows, responses_from_blows
from analysis.modes import Modes, poles_from

RATE = 1024.0
SAMPLES = 2048
PRE_TRIGGER = 64
OF_WHOLE_RECORDS = [Estimator.H1, Estimator.H2, Estimator.HV]
POINT = Dof.parse("3y")
OTHER = Dof.parse("1y")
POLE = complex(poles_from(np.array([60.0]), np.array([0.03]))[0])
FREQUENCY = np.fft.rfftfreq(SAMPLES, 1 / RATE)


def accelerance(laplace: Complex) -> Complex:
    """p^2 / (p - lambda)(p - conj lambda): one viscously damped mode of 1 kg."""
    return np.asarray(laplace**2 / ((laplace - POLE) * (laplace - POLE.conjugate())))


EXACT = accelerance(np.asarray(2j * np.pi * FREQUENCY, dtype=np.complex128))


def blows(seed: int, count: int, force_noise: float = 0.0, acceleration_noise: float = 0.0) -> tuple[Real, Real]:
    """Force and acceleration (blows, samples); the mode has died away within the record."""
    rng = np.random.default_rng(seed)
    time = (np.arange(SAMPLES) - PRE_TRIGGER) / RATE
    peaks = rng.uniform(80, 120, (count, 1))
    force = peaks * np.exp(-(((time - 3e-3) / 1e-3) ** 2))
    acceleration = np.fft.irfft(np.fft.rfft(force, axis=1) * EXACT, SAMPLES, axis=1)
    force = force + force_noise * rng.standard_normal(force.shape)
    return force, acceleration + acceleration_noise * rng.standard_normal(force.shape)


def averaged(
    force: Real, acceleration: Real, estimator: Estimator = Estimator.H1, windows: Windows | None = None
) -> FrequencyResponses:
    return responses_from_blows(
        [force], [acceleration], RATE, POINT, [POINT], 400.0, estimator,
        pre_trigger=PRE_TRIGGER, windows=windows or Windows(),
    )  # fmt: skip


@pytest.mark.parametrize("estimator", OF_WHOLE_RECORDS)
def test_blows_without_noise_give_the_exact_accelerance_with_coherence_one(estimator: Estimator) -> None:
    found = averaged(*blows(0, 3), estimator)
    lines = found.frequency > 0
    np.testing.assert_allclose(found.accelerance[0, lines], EXACT[: found.frequency.size][lines], rtol=1e-6)
    assert found.coherence is not None
    np.testing.assert_allclose(found.coherence[0, lines], 1.0, atol=1e-9)


@pytest.mark.parametrize("estimator", OF_WHOLE_RECORDS)
def test_the_average_of_what_softens_is_that_of_the_mean_blow_not_of_a_harder_one(estimator: Estimator) -> None:
    force, acceleration = blows(4, 10)
    strength = np.sqrt(np.sum(force**2, axis=1, keepdims=True))
    harder = strength / np.mean(strength) - 1
    assert np.max(np.abs(harder)) > 0.1
    found = averaged(force, (1 + 0.3 * harder) * acceleration, estimator)
    lines = found.frequency > 0
    exact = EXACT[: found.frequency.size][lines]
    # H2 and Hv are of second order in what scatters, here 1.6 %
    np.testing.assert_allclose(found.accelerance[0, lines], exact, rtol=1e-6 if estimator is Estimator.H1 else 3e-3)


@pytest.mark.parametrize("count", [2, 3])
def test_the_variance_of_few_blows_explains_their_errors(count: int) -> None:
    squares = []
    for seed in range(30):
        found = averaged(*blows(seed, count, acceleration_noise=0.5))
        assert found.variance is not None
        squares.append(np.abs(found.accelerance - EXACT[: found.frequency.size]) ** 2 / 2 / found.variance)
    assert np.mean(np.array(squares)[..., 3:-2]) == pytest.approx(1.0, rel=0.03)


def test_lines_end_at_the_highest_frequency() -> None:
    found = averaged(*blows(0, 2))
    assert found.frequency[-1] == 400.0
    assert found.frequency[1] == RATE / SAMPLES


def test_h1_is_biased_by_noise_in_the_force_h2_by_noise_in_the_response_and_hv_lies_between() -> None:
    line = int(np.argmin(np.abs(FREQUENCY - 200.0)))
    noisy_force, noisy_response = blows(1, 1000, 1.0, 0.0), blows(1, 1000, 0.0, 1.0)
    h1, h2, hv = (abs(averaged(*noisy_force, e).accelerance[0, line] / EXACT[line]) for e in OF_WHOLE_RECORDS)
    assert h1 < 0.9
    assert h1 < hv < h2 == pytest.approx(1, abs=0.03)
    assert hv**2 == pytest.approx(h1 * h2)
    h1, h2, hv = (abs(averaged(*noisy_response, e).accelerance[0, line] / EXACT[line]) for e in OF_WHOLE_RECORDS)
    assert h2 > 1.1
    assert h2 > hv > h1 == pytest.approx(1, abs=0.03)


def test_variance_from_ten_blows_weighs_errors_as_that_of_many_repeated_averages_would() -> None:
    repeats = [averaged(*blows(seed, 10, 0.02, 0.5)) for seed in range(300)]
    scatter = np.array([r.accelerance[0] - EXACT[: r.frequency.size] for r in repeats])
    stated = np.array([r.variance[0] for r in repeats if r.variance is not None])
    lines = slice(10, 600)
    for part in (scatter.real, scatter.imag):
        assert np.mean((part**2 / stated)[:, lines]) == pytest.approx(1, abs=0.03)


@pytest.mark.parametrize("estimator", list(Estimator))
def test_a_single_blow_has_no_coherence_but_a_variance_that_explains_its_errors(estimator: Estimator) -> None:
    squares = []
    for seed in range(20):
        found = averaged(*blows(seed, 1, acceleration_noise=0.5), estimator)
        assert found.coherence is None
        assert found.variance is not None
        squares.append(np.abs(found.accelerance - EXACT[: found.frequency.size]) ** 2 / 2 / found.variance)
    # 16,000 lines with one square each, of which those within a window share their variance
    assert np.mean(np.array(squares)[..., 3:-2]) == pytest.approx(1.0, abs=0.04)


def test_rows_of_one_blow_and_of_several_have_each_their_own_variance() -> None:
    one, several = blows(1, 1, acceleration_noise=0.5), blows(2, 3, acceleration_noise=0.5)
    both = responses_from_blows(
        [one[0], several[0]], [one[1], several[1]], RATE, POINT, [OTHER, POINT], 400.0, pre_trigger=PRE_TRIGGER
    )
    assert both.coherence is None
    assert both.variance is not None
    for row, alone in enumerate((averaged(*one), averaged(*several))):
        assert alone.variance is not None
        np.testing.assert_allclose(both.variance[row], alone.variance[0])


def test_a_single_blow_of_a_few_samples_has_no_variance() -> None:
    force, acceleration = np.zeros((2, 1, 16))
    force[0, 3], acceleration[0, 3:] = 1.0, 2.0
    assert responses_from_blows([force], [acceleration], RATE, POINT, [POINT]).variance is None


def test_the_local_estimate_is_without_what_a_record_that_is_cut_adds() -> None:
    short = SAMPLES // 8
    force, acceleration = (record[:, : PRE_TRIGGER + short] for record in blows(3, 5, acceleration_noise=0.02))
    frequency = np.fft.rfftfreq(force.shape[1], 1 / RATE)
    exact = accelerance(np.asarray(2j * np.pi * frequency[frequency <= 400], dtype=np.complex128))
    local, h1 = averaged(force, acceleration, Estimator.LOCAL), averaged(force, acceleration)
    assert local.variance is not None
    error, of_h1 = np.abs(local.accelerance[0] - exact), np.abs(h1.accelerance[0] - exact)
    assert np.linalg.norm(error) < 0.02 * np.linalg.norm(of_h1)
    assert np.mean(error**2 / 2 / local.variance) == pytest.approx(1.0, abs=0.4)


def test_an_offset_before_the_trigger_is_removed_before_windows_act() -> None:
    force, acceleration = blows(0, 2)
    window = Windows(decay=3.0)
    clean, offset = averaged(force, acceleration, windows=window), averaged(force + 2, acceleration - 5, windows=window)
    np.testing.assert_allclose(offset.accelerance, clean.accelerance, rtol=1e-9, atol=1e-9)


def test_an_exponential_window_moves_the_pole_left_by_its_decay() -> None:
    found = averaged(*blows(0, 2), windows=Windows(decay=5.0))
    expected = accelerance(np.asarray(5.0 + 2j * np.pi * found.frequency, dtype=np.complex128))
    left_at_the_end = np.exp(POLE.real * SAMPLES / RATE)
    np.testing.assert_allclose(found.accelerance[0], expected, atol=3 * left_at_the_end * np.max(np.abs(expected)))


def test_the_damping_that_a_window_adds_is_stated() -> None:
    windowed = Modes(np.array([POLE - 5.0]), np.ones((1, 1), complex), (POINT,))
    added = Windows(decay=5.0).added_loss_factor(windowed.frequency)
    np.testing.assert_allclose(windowed.loss_factor - 0.03, added, rtol=2e-3)


@pytest.mark.parametrize("estimator", OF_WHOLE_RECORDS)
def test_the_scatter_of_blows_is_by_how_much_an_average_moves_without_them(estimator: Estimator) -> None:
    force, acceleration = blows(2, 10, 0.005, 0.05)
    whole = averaged(force, acceleration, estimator)
    assert whole.scatter is not None
    lines = slice(60, 600)
    for left_out in range(3):
        others = np.arange(10) != left_out
        without = averaged(force[others], acceleration[others], estimator).accelerance[0, lines]
        moved = np.sqrt(9 / 10) * (whole.accelerance[0, lines] - without)
        stated = whole.scatter[0, left_out, lines]
        assert np.linalg.norm(moved - stated) < 0.1 * np.linalg.norm(stated)


def test_accelerances_say_which_window_is_on_them_and_count_on_the_noise_that_it_ties_together() -> None:
    force, acceleration = blows(4, 10, acceleration_noise=0.5)
    plain, windowed = averaged(force, acceleration), averaged(force, acceleration, windows=Windows(decay=5.0))
    assert (plain.decay, windowed.decay) == (0.0, 5.0)
    assert windowed.scatter is not None
    assert windowed.variance is not None
    assert plain.variance is not None
    assert np.mean(windowed.variance) > np.mean(plain.variance)
    of_lines = np.mean(np.sum(np.abs(windowed.scatter) ** 2, axis=1)) / 2
    kept = (1 - np.exp(-2 * 5.0 * SAMPLES / RATE)) / (2 * 5.0 * SAMPLES / RATE)
    raised = 90 / 88  # as a weight, of ten blows and five lines
    assert raised * of_lines / np.mean(windowed.variance) == pytest.approx(kept, rel=1e-2)


def test_a_force_window_removes_the_noise_behind_the_blow() -> None:
    force, acceleration = blows(3, 200, force_noise=1.0)
    line = int(np.argmin(np.abs(FREQUENCY - 200.0)))
    plain, windowed = averaged(force, acceleration), averaged(force, acceleration, windows=Windows(force_duration=0.05))
    bias, windowed_bias = (abs(abs(r.accelerance[0, line] / EXACT[line]) - 1) for r in (plain, windowed))
    assert windowed_bias < 0.2 * bias


@given(gain=st.floats(1e-3, 1e3), push=st.floats(1e-3, 1e3))
def test_accelerance_scales_with_the_gains_and_coherence_does_not(gain: float, push: float) -> None:
    force, acceleration = blows(5, 3, 0.02, 0.1)
    base, scaled = averaged(force, acceleration), averaged(push * force, gain * acceleration)
    assert base.variance is not None
    assert scaled.variance is not None
    np.testing.assert_allclose(scaled.accelerance, base.accelerance * gain / push, rtol=1e-9, atol=1e-12 * gain / push)
    np.testing.assert_allclose(scaled.variance, base.variance * (gain / push) ** 2, rtol=1e-6)


def test_a_point_without_blows_is_named() -> None:
    force, acceleration = blows(0, 2)
    with pytest.raises(AnalysisError, match="no blow at 1y"):
        responses_from_blows([force, force[:0]], [acceleration, acceleration[:0]], RATE, POINT, [POINT, OTHER])


def test_records_of_unequal_length_name_the_point() -> None:
    force, acceleration = blows(0, 2)
    with pytest.raises(AnalysisError, match="at 1y force has shape"):
        responses_from_blows([force, force[:, 1:]], [acceleration, acceleration[:, 1:]], RATE, POINT, [POINT, OTHER])


def test_a_point_without_a_name_is_refused() -> None:
    force, acceleration = blows(0, 2)
    with pytest.raises(AnalysisError, match="give all three"):
        responses_from_blows([force], [acceleration], RATE, POINT, [])


def test_a_dead_hammer_is_named() -> None:
    force, acceleration = blows(0, 2)
    with pytest.raises(AnalysisError, match="hammer's cable"):
        averaged(0 * force, acceleration)
