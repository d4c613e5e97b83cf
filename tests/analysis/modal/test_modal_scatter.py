"""Covariances from the scatter of single blows: equal to those of noise where there is only noise, and wider where
blows land beside their mark."""

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import FrequencyResponses, Real
from analysis.modal.estimation import estimate_modes
from analysis.modal.response_variance import smoothed_variance
from analysis.modal.spectra import responses_from_blows
from analysis.modes import Modes, poles_from

LINES = np.arange(20.0, 220.0, 0.5)
INPUTS = tuple(Dof(node, Dof.parse("1y").direction) for node in range(1, 6))
FREQUENCY, LOSS_FACTOR = np.array([60.0, 140.0]), np.array([0.04, 0.02])
CONSTANTS = np.array([[0.9, 0.5, -0.3, 0.4, 0.8], [0.7, -0.4, 0.6, 0.3, -0.5]])
PLACE = np.array([[0.3, 0.6, 0.5, -0.4, -0.2], [-0.5, 0.4, 0.2, 0.6, 0.3]])  # of the constants by the place, per width
BLOWS = 10
NOISE = 0.003


def measured(seed: int, place: float, blows: int = BLOWS, points: int = len(INPUTS)) -> FrequencyResponses:
    """Averages of blows with noise, each blow off its mark by `place` times a normal number."""
    rng = np.random.default_rng(seed)
    square = (2j * np.pi * LINES) ** 2
    units = square / (square - poles_from(FREQUENCY, LOSS_FACTOR)[:, None] ** 2)
    off = place * rng.standard_normal((len(INPUTS), blows))
    constants = CONSTANTS.T[:, None] + off[..., None] * PLACE.T[:, None]  # (rows, blows, modes)
    noise = rng.standard_normal((2, len(INPUTS), blows, LINES.size)) * NOISE * np.sqrt(blows)
    single = constants @ units + noise[0] + 1j * noise[1]
    mean = np.mean(single, axis=1)
    scatter = (single - mean[:, None]) / blows * np.sqrt(blows / (blows - 1))
    variance = smoothed_variance(np.sum(np.abs(scatter) ** 2, axis=1) / 2)
    kept = slice(points)
    return FrequencyResponses(
        LINES, mean[kept], INPUTS[0], INPUTS[kept], variance=variance[kept], scatter=scatter[kept]
    )


def deviations(modes: Modes) -> tuple[Real, Real]:
    """Errors of poles (4,) and of constants (2, 5) over their standard deviations."""
    assert modes.pole_covariance is not None
    assert modes.shape_covariance is not None
    pole = np.stack([modes.frequency - FREQUENCY, modes.loss_factor - LOSS_FACTOR], axis=1).ravel()
    points = len(modes.dofs)
    constant = modes.shapes.real - CONSTANTS[:, :points]
    spread = np.sqrt(np.diagonal(modes.shape_covariance, axis1=1, axis2=2))[:, :points]
    return pole / np.sqrt(np.diag(modes.pole_covariance)), constant / spread


@pytest.mark.parametrize("place", [0.0, 0.05])
def test_standard_deviations_are_those_of_repeated_tests(place: float) -> None:
    found = [deviations(estimate_modes(measured(seed, place), highest_order=20).modes) for seed in range(40)]
    poles, constants = (np.array(each) for each in zip(*found, strict=True))
    # a standard deviation from nine differences has Student's distribution, with a root mean square of 1.13
    assert np.sqrt(np.mean(poles**2)) == pytest.approx(1.06, abs=0.15)
    assert np.sqrt(np.mean(constants**2)) == pytest.approx(1.13, abs=0.15)


def test_intervals_hold_where_the_poles_hang_on_few_blows() -> None:
    """Four blows at two points: three differences each, whose scatter a normal interval would take for known."""
    held, normal = [], []
    for seed in range(100):
        estimate = estimate_modes(measured(seed, 0.0, blows=4, points=2), highest_order=20)
        assert np.all((estimate.degrees_of_freedom >= 3) & (estimate.degrees_of_freedom < 6.01))
        for true, (low, high) in zip(
            (FREQUENCY, LOSS_FACTOR), (estimate.frequency_ci95.T, estimate.loss_factor_ci95.T), strict=True
        ):
            held.append((low < true) & (true < high))
        normal.append(np.abs(deviations(estimate.modes)[0]) < 1.96)
    assert np.mean(held) == pytest.approx(0.95, abs=0.03)
    assert np.mean(normal) < 0.92


def test_noise_alone_would_be_trusted_far_too_much() -> None:
    responses = measured(1, 0.05)
    alone = FrequencyResponses(LINES, responses.accelerance, INPUTS[0], INPUTS, variance=responses.variance)
    with_blows, without = (estimate_modes(each, highest_order=20).modes.shape_covariance for each in (responses, alone))
    assert with_blows is not None
    assert without is not None
    ratio = np.diagonal(with_blows, axis1=1, axis2=2) / np.diagonal(without, axis1=1, axis2=2)
    assert np.median(ratio[:, : len(INPUTS)]) > 9


def test_scatter_adds_up_to_the_variance_and_follows_the_lines_of_a_band() -> None:
    rng = np.random.default_rng(0)
    force = [rng.standard_normal((blows, 256)) for blows in (4, 6)]
    acceleration = [rng.standard_normal((blows, 256)) for blows in (4, 6)]
    responses = responses_from_blows(force, acceleration, 256.0, INPUTS[0], INPUTS[:2], smoothed_over=1)
    assert responses.scatter is not None
    assert responses.scatter.shape == (2, 6, 129)
    assert responses.variance == pytest.approx(np.sum(np.abs(responses.scatter) ** 2, axis=1) / 2)
    band = responses.band(10.0, 20.0)
    assert band.scatter is not None
    assert np.array_equal(band.scatter, responses.scatter[..., 10:21])


def test_three_blows_are_too_few_to_tell_how_blows_scatter() -> None:
    rng = np.random.default_rng(0)
    force = [rng.standard_normal((blows, 256)) for blows in (3, 6)]
    assert responses_from_blows(force, force, 256.0, INPUTS[0], INPUTS[:2]).scatter is None


def test_scatter_of_another_shape_is_refused() -> None:
    with pytest.raises(AnalysisError, match="scatter has shape"):
        FrequencyResponses(
            LINES, np.ones((5, LINES.size), complex), INPUTS[0], INPUTS, scatter=np.ones((5, 10, 3), complex)
        )
