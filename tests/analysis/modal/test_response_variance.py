"""Variances of accelerances from scatter, coherence, neighbouring lines and residuals."""

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex
from analysis.modal.response_variance import (
    blow_scatter,
    smoothed_variance,
    variance_from_coherence,
    variance_from_neighbours,
    variance_from_residual,
    variance_from_scatter,
    weighed_over_more,
    weighing_variance,
)

LINES = 2000


def noise(rng: np.random.Generator, *shape: int) -> Complex:
    return np.asarray(rng.standard_normal(shape) + 1j * rng.standard_normal(shape))


def test_coherence_of_ten_blows_gives_their_variance_without_bias() -> None:
    rng = np.random.default_rng(0)
    force = noise(rng, 10, LINES) + 30
    acceleration = 2 * force + noise(rng, 10, LINES)
    cross, power = np.sum(acceleration * force.conj(), axis=0), np.sum(np.abs(force) ** 2, axis=0)
    accelerance = cross / power
    coherence = np.abs(cross) ** 2 / power / np.sum(np.abs(acceleration) ** 2, axis=0)
    true = np.mean(1 / power)
    assert np.mean(variance_from_coherence(accelerance, coherence, 10)) == pytest.approx(true, rel=0.03)
    assert np.mean(variance_from_scatter(blow_scatter(force, acceleration, accelerance))) == pytest.approx(
        true, rel=0.03
    )


def test_variance_from_coherence_tends_to_the_textbook_formula() -> None:
    value = variance_from_coherence(np.array([3.0 + 4j]), np.array([0.9]), 100_001)
    assert value[0] == pytest.approx((1 - 0.9) / (2 * 100_000 * 0.9) * 25)


@pytest.mark.parametrize(("coherence", "averages"), [(0.9, 1), (1.1, 10), (-0.1, 10)])
def test_an_impossible_coherence_is_refused(coherence: float, averages: int) -> None:
    with pytest.raises(AnalysisError):
        variance_from_coherence(np.array([1 + 0j]), np.array([coherence]), averages)


def test_one_blow_has_no_scatter() -> None:
    with pytest.raises(AnalysisError, match="twice"):
        blow_scatter(np.ones((1, 4), complex), np.ones((1, 4), complex), np.ones(4, complex))


def test_neighbouring_lines_tell_the_noise_under_a_resonance() -> None:
    rng = np.random.default_rng(1)
    frequency = np.linspace(0.5, 1000, LINES)
    peak = -(frequency**2) / (400**2 * (1 + 0.02j) - frequency**2)
    found = variance_from_neighbours(peak[None, :] + 0.01 * noise(rng, 3, LINES))
    assert np.median(found) == pytest.approx(1e-4, rel=0.05)


def test_the_noise_of_the_first_and_last_lines_is_that_of_many_lines_too() -> None:
    rng = np.random.default_rng(7)
    found = variance_from_neighbours(0.01 * noise(rng, 400, 64))
    for line in (0, 32, -1):
        assert np.median(found[:, line]) == pytest.approx(1e-4, rel=0.1)
        assert np.std(np.log(found[:, line])) < 0.6


def test_residuals_tell_a_floor_from_a_part_that_grows_with_the_response() -> None:
    rng = np.random.default_rng(2)
    fitted = (10 ** rng.uniform(-2, 2, (2, LINES))).astype(np.complex128)
    true = 0.05**2 + (0.03 * np.abs(fitted)) ** 2
    found = variance_from_residual(fitted + np.sqrt(true) * noise(rng, 2, LINES), fitted)
    np.testing.assert_allclose(found, true, rtol=0.2)


def test_a_row_that_fits_exactly_keeps_a_small_variance() -> None:
    fitted = np.linspace(1, 2, 50)[None, :].astype(np.complex128)
    found = variance_from_residual(fitted, fitted)
    assert np.all(found > 0)
    assert np.all(found < 1e-16)


def test_smoothing_keeps_the_mean_and_lowers_the_scatter_of_a_variance() -> None:
    rough = np.random.default_rng(3).chisquare(18, (1, LINES)) / 18
    smooth = smoothed_variance(rough, 5)
    assert np.mean(smooth) == pytest.approx(np.mean(rough), rel=1e-2)
    assert np.std(smooth) == pytest.approx(np.std(rough) / np.sqrt(5), rel=0.1)


def test_the_mean_over_neighbours_of_lines_far_larger_is_still_positive() -> None:
    variance = np.concatenate([np.full(20, 1e12), np.full(20, 1e-12)])[None]
    smoothed = smoothed_variance(variance)
    assert np.all(smoothed > 0)
    np.testing.assert_allclose(smoothed[0, [5, 30]], [1e12, 1e-12])


def test_a_floor_that_rises_with_frequency_is_followed_row_by_row() -> None:
    rng = np.random.default_rng(4)
    frequency = np.arange(1.0, 2001.0)
    true = np.array([[1.0], [3.0]]) * (0.01 + (frequency / 2000) ** 3)
    fitted = np.array([[1.0], [-0.7]]) * frequency**2 / (900**2 * (1 + 0.05j) - frequency**2)
    error = np.log(variance_from_residual(fitted + true * noise(rng, 2, 2000), fitted, frequency) / true**2)
    assert np.max(np.abs(error)) < 0.6  # the true variance rises by a factor of 10 000
    assert np.mean(error) == pytest.approx(0, abs=0.1)


def test_too_few_lines_have_no_neighbours_to_differ_from() -> None:
    with pytest.raises(AnalysisError, match="4 lines are too few"):
        variance_from_neighbours(noise(np.random.default_rng(1), 2, 4))


@pytest.mark.parametrize("count", [2, 3, 10])
def test_squared_errors_over_the_variance_of_few_blows_are_one_on_the_mean(count: int) -> None:
    rng = np.random.default_rng(count)
    blows = noise(rng, 40, count, LINES)
    mean = np.mean(blows, axis=1)
    by_line = np.sum(np.abs(blows - mean[:, None]) ** 2, axis=1) / (2 * count * (count - 1))
    square = np.abs(mean) ** 2 / 2 / weighing_variance(by_line, count)
    assert np.mean(square[:, 2:-2]) == pytest.approx(1.0, rel=0.02)
    # 160 values of the two lines at either end, and those of two blows vary the most
    assert np.mean(square[:, [0, 1, -2, -1]]) == pytest.approx(1.0, rel=0.35)


@pytest.mark.parametrize("count", [2, 3, 4, 8])
def test_squared_errors_over_a_weight_that_was_averaged_again_are_one_on_the_mean(count: int) -> None:
    rng = np.random.default_rng(10 + count)
    blows = noise(rng, 40, count, LINES)
    mean = np.mean(blows, axis=1)
    by_line = np.sum(np.abs(blows - mean[:, None]) ** 2, axis=1) / (2 * count * (count - 1))
    variance = weighed_over_more(weighing_variance(by_line, count), count, 9)
    assert np.mean(np.abs(mean) ** 2 / 2 / variance) == pytest.approx(1.0, abs=4 * np.sqrt(1.1 / mean.size))


def test_a_mean_over_five_and_again_over_nine_lines_has_the_freedom_of_eleven() -> None:
    squares = np.sum(np.convolve(np.full(5, 1 / 5), np.full(9, 1 / 9)) ** 2)
    assert 1 / squares == pytest.approx(11, rel=0.01)
    by_row = weighed_over_more(weighing_variance(np.ones((2, 60)), [2, 10]), [2, 10], 9)
    np.testing.assert_allclose(by_row[:, 30], [1 / (1 - squares), 1 / (1 - squares / 9)])
    np.testing.assert_allclose(by_row, by_row[:, ::-1])
    assert np.all(np.diff(by_row[:, :7]) < 0)


def test_rows_of_few_blows_are_raised_by_more_than_rows_of_many() -> None:
    raised = weighing_variance(np.ones((3, 9)), [2, 3, 10])
    np.testing.assert_allclose(raised[:, 4], [10 / 8, 20 / 18, 90 / 88])
    np.testing.assert_allclose(raised[0], raised[0, ::-1])
    assert raised[0, 0] > raised[0, 1] > raised[0, 2]


def test_a_coherence_of_one_in_a_rounded_file_is_half_a_step_below_one() -> None:
    coherence = np.round(np.linspace(0.99, 1.0, 101), 3)[None]
    assert np.sum(coherence == 1) > 1
    found = variance_from_coherence(np.ones((1, 101), complex), coherence, 10)
    np.testing.assert_allclose(found[coherence == 1], 0.0005 / (2 * 9 * 0.9995))
    np.testing.assert_allclose(found[coherence == 0.999], 0.001 / (2 * 9 * 0.999))


def test_lines_without_signal_do_not_tell_how_finely_a_file_rounds() -> None:
    coherence = np.array([[0.0, 0.1234, 0.12341, 0.998, 0.999, 1.0]])
    found = variance_from_coherence(np.ones((1, 6), complex), coherence, 10)
    assert found[0, -1] == pytest.approx(0.0005 / (2 * 9 * 0.9995))
