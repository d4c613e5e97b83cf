"""Slopes of the soak hold what they claim."""

import numpy as np
import pytest

from tests.bench.slopes import slope_of


def test_a_straight_line_has_its_slope_and_no_error() -> None:
    seconds = np.arange(0.0, 3600.0, 60.0)
    found = slope_of(seconds, 5.0 + 2.5 * seconds / 3600.0)
    assert found.value == pytest.approx(2.5)
    assert found.error == pytest.approx(0.0, abs=1e-9)


def test_the_error_is_the_scatter_of_slopes_of_values_that_are_alike() -> None:
    random, seconds = np.random.default_rng(1), np.arange(200.0)
    slopes, errors = [], []
    for _ in range(400):
        noise = np.zeros(200)
        for each in range(1, 200):
            noise[each] = 0.5 * noise[each - 1] + random.standard_normal()
        found = slope_of(seconds, noise)
        slopes.append(found.value)
        errors.append(found.error)
    assert np.mean(errors) == pytest.approx(np.std(slopes), rel=0.15)


def test_too_few_values_have_no_error() -> None:
    with pytest.raises(ValueError, match="three values, there are 2"):
        slope_of(np.array([0.0, 1.0]), np.array([1.0, 2.0]))
