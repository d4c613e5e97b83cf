"""Blows at another point are found beside those at the right one, on blows of the simulated hand."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.modal.blow_check import BlowFault
from analysis.modal.point_check import check_point
from simlab.bench import Bench
from simlab.clock import Clock

RATE, SAMPLES = 4096.0, 8192
BAND = (20.0, 1024.0)


def blows(*points: str, seed: int = 1) -> tuple[Real, Real]:
    """Records of clean blows at these points, one after the other."""
    bench = Bench(seed, Clock())
    records = []
    for number, point in enumerate(points):
        bench.strike(int(point[:-1]), point[-1], at=1 + 5.0 * number, what="clean")
        records.append(bench.hammer_signals(0.95 + 5.0 * number, RATE, SAMPLES))
    return np.array([each["hammer"] for each in records]), np.array([each["accelerometer"] for each in records])


@pytest.mark.parametrize("point", ["1y", "6y", "9y", "1x"])
def test_blows_at_one_mark_fit_each_other(point: str) -> None:
    force, acceleration = blows(*[point] * 6)
    for count in range(7):
        assert check_point(force[:count], acceleration[:count], RATE, BAND) == (None,) * count


@pytest.mark.parametrize("wrong", range(4))
def test_a_blow_at_the_neighbouring_point_is_found_wherever_it_came(wrong: int) -> None:
    struck = ["8y"] * 4
    struck[wrong] = "9y"
    found = check_point(*blows(*struck), RATE, BAND)
    assert [reason is not None for reason in found] == [blow == wrong for blow in range(4)]
    reason = found[wrong]
    assert reason is not None
    assert reason.fault is BlowFault.WRONG_POINT
    assert "was another point struck?" in str(reason)


def test_the_difference_is_told_in_figures() -> None:
    reason = check_point(*blows("3y", "3y", "3y", "4y"), RATE, BAND)[3]
    assert "between 20 and 1024 Hz the accelerance of this blow differs from the others by 4" in str(reason)
    assert "theirs from each other by 4 %" in str(reason)


def test_a_blow_from_the_other_side_is_told_as_such() -> None:
    force, acceleration = blows("5y", "5y", "5y", "5y")
    acceleration[1] *= -1
    found = check_point(force, acceleration, RATE, BAND)
    assert [reason is not None for reason in found] == [False, True, False, False]
    assert "opposite sign" in str(found[1])


def test_of_two_blows_nobody_knows_which_is_wrong() -> None:
    assert check_point(*blows("8y", "9y"), RATE, BAND) == (None, None)


def test_nothing_is_told_where_blows_disagree_anyway() -> None:
    """Along the bar a lean of a degree changes the accelerance by as much as it is large."""
    assert check_point(*blows("1x", "1x", "1x", "1x", "11x"), RATE, BAND) == (None,) * 5


def test_records_that_do_not_belong_together_are_refused() -> None:
    force, acceleration = blows("8y", "8y", "8y")
    with pytest.raises(AnalysisError, match="give equal ones"):
        check_point(force[:, :-1], acceleration, RATE, BAND)
    with pytest.raises(AnalysisError, match="no lines between 3000 and 4000 Hz"):
        check_point(force, acceleration, RATE, (3000.0, 4000.0))
