"""Sizes of causes that a model lacks, by their scores alone."""

import numpy as np
import pytest

from analysis.frequency_response import Real
from analysis.inverse.model_error import likely_sizes

ALIKE = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, 0.0], [0.0, 0.0, 4.0]])


def test_noise_speaks_of_no_cause_or_of_small_ones() -> None:
    rng = np.random.default_rng(1)
    root = np.linalg.cholesky(ALIKE)
    sizes = np.array([likely_sizes(root @ rng.standard_normal(3), ALIKE, ALIKE) for _ in range(400)])
    standard_error = 1 / np.sqrt(np.diag(ALIKE))
    assert np.all(np.mean(sizes == 0.0, axis=0) > 0.6)
    assert np.all(np.mean(sizes**2, axis=0) < 0.25 * standard_error**2)


def test_a_cause_gets_its_size_and_one_that_looks_like_it_gets_none() -> None:
    sizes = likely_sizes(ALIKE @ np.array([10.0, 0.0, 0.0]), ALIKE, ALIKE)
    np.testing.assert_allclose(sizes, [np.sqrt(99.0), 0.0, 0.0], rtol=1e-6)


def test_scores_that_scatter_more_than_their_information_speak_of_less() -> None:
    score = np.array([0.0, 0.0, 12.0])
    sure, unsure = (likely_sizes(score, ALIKE, scatter * ALIKE)[2] for scatter in (1.0, 9.0))
    assert sure == pytest.approx(np.sqrt(3.0**2 - 1 / 4), rel=1e-3)
    assert 0.0 < unsure < np.sqrt(3.0**2 - 9 / 4)  # as it may be noise altogether


@pytest.mark.parametrize("cause", [0.0, 1.0, 2.0, 4.0, 8.0])
def test_intervals_that_allow_for_the_size_hold_whatever_the_cause(cause: float) -> None:
    """A term that one unit of the cause moves by 0.4 standard errors; the cause is known to one unit."""
    rng, moves = np.random.default_rng(2), 0.4
    error = rng.standard_normal(2000) + moves * cause
    one: Real = np.eye(1)
    sizes = np.array([likely_sizes(np.array([cause + each]), one, one)[0] for each in rng.standard_normal(error.size)])
    assert (
        np.mean(np.abs(error) < 1.96 * np.hypot(1.0, moves * sizes)) > 0.92
    )  # 94 % at worst, known to half a per cent
