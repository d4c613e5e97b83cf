"""A straight line through results over time."""

import numpy as np
import pytest

from analysis.direct.trend import change


def test_a_straight_line_is_found_with_no_error() -> None:
    found = change([0.0, 10.0, 30.0], [2.0, 2.2, 2.6])
    assert found is not None
    assert found.value == pytest.approx(0.6 / np.mean([2.0, 2.2, 2.6]))
    assert found.standard_error == pytest.approx(0.0, abs=1e-12)
    assert found.degrees_of_freedom == 1


def test_intervals_hold_the_true_change_as_often_as_they_say() -> None:
    random, time, drawn = np.random.default_rng(1), np.array([0.0, 1.0, 2.0, 5.0, 9.0, 12.0]), 4000
    held = 0
    for _ in range(drawn):
        value = 1.0 + 0.05 * (time - time.mean()) / 12 + random.normal(0, 0.02, time.size)
        found = change(time.tolist(), value.tolist())
        assert found is not None
        low, high = found.interval()
        held += low <= 0.05 <= high
    assert held / drawn == pytest.approx(0.95, abs=0.015)


@pytest.mark.parametrize(("time", "value"), [([0, 1], [1, 2]), ([3, 3, 3], [1, 2, 3]), ([0, 1, 2], [-1, 0, 1])])
def test_there_is_no_trend_where_a_line_says_nothing(time: list[float], value: list[float]) -> None:
    assert change(time, value) is None
