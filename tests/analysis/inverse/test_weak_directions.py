from __future__ import annotations

import numpy as np
import pytest

from analysis.inverse.weak_directions import weak_directions


def test_a_weak_difference_is_put_into_words() -> None:
    covariance = 1e-6 * np.eye(24)
    covariance[np.ix_([0, 12], [0, 12])] += 26.0**2 / 4 * np.array([[1, -1], [-1, 1]])
    values = np.full(24, 100.0)
    (found,) = weak_directions(covariance, ("I", "II"), np.ones((3, 3)), values)
    assert found.text == (
        "k11(I) - k11(II) is known to +-26 EI/L^3 (one standard deviation), k11(I) + k11(II) to 0.0014"
    )
    assert found.standard_deviation == pytest.approx(26.0)


def test_a_single_weak_damping_is_named_alone() -> None:
    covariance = 1e-6 * np.eye(12)
    covariance[9, 9] = 9.0
    (found,) = weak_directions(covariance, ("I",), np.ones((3, 3)), np.full(12, 10.0))
    assert found.terms == (("h22(I)", 1.0),)
    assert found.text == "h22(I) is known to +-3 EI/L^3 (one standard deviation)"


def test_a_well_determined_joint_has_no_weak_direction() -> None:
    assert weak_directions(1e-6 * np.eye(12), ("I",), np.ones((3, 3)), np.full(12, 10.0)) == ()


def test_a_difference_is_told_even_where_it_is_small_if_the_sum_is_known_far_better() -> None:
    covariance = np.diag(np.full(24, 1e-8))
    covariance[np.ix_([0, 12], [0, 12])] += np.array([[1, -1], [-1, 1]])
    (found,) = weak_directions(covariance, ("I", "II"), np.ones((3, 3)), np.full(24, 100.0))
    assert found.terms == (("k11(I)", 1.0), ("k11(II)", -1.0))
