"""Which terms are known on their own, and of the others why not."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from analysis.interval import Z95
from analysis.inverse.observability import TermBound
from analysis.inverse.undetermined_terms import (
    DETERMINED_HALF_WIDTH,
    SUM_ONLY,
    term_names,
    too_wide,
    undetermined,
    weak_directions,
)

NAMES = ("k11(I)", "k11(II)", "k22(I)", "k33(I)")


def test_a_term_counts_as_determined_on_its_own_and_to_a_quarter() -> None:
    bound = np.diag([1.0, 1.0, 1.0, 1.0])
    bound[0, 1] = bound[1, 0] = -0.9999
    found = undetermined(bound, np.array([100.0, 100.0, 100.0, 7.0]), NAMES)
    assert found.tolist() == [
        "only k11(I) + k11(II) is seen",
        "only k11(II) + k11(I) is seen",
        "",
        "these data leave ±28 % at best (95 %), less than ±25 % would be enough",
    ]


@pytest.mark.parametrize(("width", "said"), [(0.2502, "25.02"), (0.2504, "25.04"), (0.254, "25.4"), (0.26, "26")])
def test_a_width_is_told_with_the_decimals_that_show_it_is_too_much(width: float, said: str) -> None:
    (text,) = too_wide(np.array([[(width / Z95) ** 2]]), np.array([1.0]), "these data leave")
    assert text == f"these data leave ±{said} % at best (95 %), less than ±25 % would be enough"


def test_what_is_seen_is_named_by_the_direction_that_is_known() -> None:
    bound = np.diag([1.0, 4.0, 1.0, 9.0])
    bound[0, 2] = bound[2, 0] = 0.9999  # of like sign: their difference is known
    bound[1, 3] = bound[3, 1] = -0.9999 * 6
    difference, weighted, *_ = undetermined(bound, np.full(4, 100.0), ("k22(I)", "k12(I)", "k22(II)", "k33(II)"))
    assert difference == "only k22(I) - k22(II) is seen"
    assert weighted == "only a weighted sum of k12(I) and k33(II) is seen"


def test_a_weak_term_names_those_that_it_goes_with() -> None:
    bound = np.diag([1.0, 1.0, 1.0, 1.0])
    bound[2, 3] = bound[3, 2] = 0.95
    *_, rotation = undetermined(bound, np.array([100.0, 100.0, 100.0, 1.0]), NAMES)
    assert rotation == "the 95 % interval that these data leave at best is wider than the value; it goes with k22(I)"


def test_a_term_that_is_zero_is_known_to_no_share_of_itself() -> None:
    assert too_wide(np.eye(2), np.array([0.0, 1e3]), "the bench leaves").tolist() == [
        "the 95 % interval that the bench leaves at best is wider than the value",
        "",
    ]


@given(arrays(float, (4, 4), elements=st.floats(-3, 3)), arrays(float, 4, elements=st.floats(-50, 50)))
def test_a_term_has_no_reason_exactly_where_it_is_known_alone_and_well(root: np.ndarray, values: np.ndarray) -> None:
    bound = root @ root.T + 0.01 * np.eye(4)
    deviation = np.sqrt(np.diag(bound))
    tied = np.abs(bound / np.outer(deviation, deviation) - np.eye(4)).max(axis=1) >= SUM_ONLY
    assume(not np.isclose(Z95 * deviation, DETERMINED_HALF_WIDTH * np.abs(values)).any())
    known = ~tied & (Z95 * deviation < DETERMINED_HALF_WIDTH * np.abs(values))
    np.testing.assert_array_equal(undetermined(bound, values, NAMES) == "", known)


def test_names_run_over_the_terms_of_each_joint() -> None:
    names = term_names(("I", "II"))
    assert len(names) == 24
    assert (names[0], names[5], names[12], names[-1]) == ("k11(I)", "k33(I)", "k11(II)", "h33(II)")


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


@pytest.mark.parametrize(
    ("place", "joint", "said"),
    [
        (1, "3", "k12(3) is known to +-3 EI/L^3 (one standard deviation)"),
        (4, "I", "k23(I) is known to +-3 EI/L^2 (one standard deviation)"),
        (5, "I", "k33(I) is known to +-3 EI/L (one standard deviation)"),
    ],
)
def test_a_weak_term_has_its_own_unit_whatever_its_joint_is_called(place: int, joint: str, said: str) -> None:
    covariance = 1e-6 * np.eye(12)
    covariance[place, place] = 9.0
    (found,) = weak_directions(covariance, (joint,), np.ones((3, 3)), np.full(12, 10.0))
    assert found.text == said


def test_terms_of_several_units_say_in_which_each_of_them_counts() -> None:
    covariance = 1e-6 * np.eye(12)
    covariance[np.ix_([1, 4, 5], [1, 4, 5])] += 9.0
    (found,) = weak_directions(covariance, ("I",), np.ones((3, 3)), np.full(12, 10.0))
    assert found.text == (
        "k12(I) + k23(I) + k33(I) is known to +-9 (one standard deviation; terms in EI/L^3, EI/L^2 and EI/L)"
    )


def test_the_cause_that_leaves_the_wider_interval_is_told() -> None:
    values, drawn = np.full(3, 7.0), np.diag([1.0, 1.0, 0.01])
    for bench, said in (
        (
            np.diag([1.1, 400.0, 400.0]),
            ("these data leave ±28 %", "tolerances leave at best is", "tolerances leave at"),
        ),
        (drawn, ("these data leave ±28 %", "these data leave ±28 %", "")),
    ):
        found = TermBound(drawn, bench).undetermined(values, ("k11(I)", "k22(I)", "k33(I)"))
        assert all(words in text for text, words in zip(found.tolist(), said, strict=True)), found
    known_in_a_sum = drawn.copy()
    known_in_a_sum[0, 1] = known_in_a_sum[1, 0] = -0.9999
    first, *_ = TermBound(known_in_a_sum, np.diag([400.0, 400.0, 400.0])).undetermined(values, NAMES[:3])
    assert first == "only k11(I) + k11(II) is seen"
