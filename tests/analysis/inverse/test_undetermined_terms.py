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
    KnownInSum,
    LeftBy,
    TooWide,
    term_names,
    too_wide,
    undetermined,
    weak_directions,
)

NAMES = ("k11(I)", "k11(II)", "k22(I)", "k33(I)")


def test_a_term_counts_as_determined_on_its_own_and_to_a_quarter() -> None:
    bound = np.diag([1.0, 1.0, 1.0, 1.0])
    bound[0, 1] = bound[1, 0] = -0.9999
    assert undetermined(bound, np.array([100.0, 100.0, 100.0, 7.0]), NAMES).tolist() == [
        KnownInSum("k11(I)", "k11(II)", is_sum=True, weighted=False),
        KnownInSum("k11(II)", "k11(I)", is_sum=True, weighted=False),
        None,
        TooWide(LeftBy.DATA, Z95 / 7),
    ]


def test_what_is_known_of_two_terms_is_their_sum_or_difference_with_or_without_weights() -> None:
    bound = np.diag([1.0, 4.0, 1.0, 9.0])
    bound[0, 2] = bound[2, 0] = 0.9999  # of like sign: their difference is known
    bound[1, 3] = bound[3, 1] = -0.9999 * 6
    difference, weighted, *_ = undetermined(bound, np.full(4, 100.0), ("k22(I)", "k12(I)", "k22(II)", "k33(II)"))
    assert difference == KnownInSum("k22(I)", "k22(II)", is_sum=False, weighted=False)
    assert weighted == KnownInSum("k12(I)", "k33(II)", is_sum=True, weighted=True)


def test_a_weak_term_names_those_that_it_is_correlated_with() -> None:
    bound = np.diag([1.0, 1.0, 1.0, 1.0])
    bound[2, 3] = bound[3, 2] = 0.95
    *_, rotation = undetermined(bound, np.array([100.0, 100.0, 100.0, 1.0]), NAMES)
    assert rotation == TooWide(LeftBy.DATA, Z95, ("k22(I)",))


def test_a_term_that_is_zero_is_known_to_no_share_of_itself() -> None:
    found = too_wide(np.eye(2), np.array([0.0, 1e3]), LeftBy.TOLERANCES)
    assert found.tolist() == [TooWide(LeftBy.TOLERANCES, np.inf), None]


@given(arrays(float, (4, 4), elements=st.floats(-3, 3)), arrays(float, 4, elements=st.floats(-50, 50)))
def test_a_term_has_no_reason_exactly_where_it_is_known_alone_and_well(root: np.ndarray, values: np.ndarray) -> None:
    bound = root @ root.T + 0.01 * np.eye(4)
    deviation = np.sqrt(np.diag(bound))
    tied = np.abs(bound / np.outer(deviation, deviation) - np.eye(4)).max(axis=1) >= SUM_ONLY
    assume(not np.isclose(Z95 * deviation, DETERMINED_HALF_WIDTH * np.abs(values)).any())
    known = ~tied & (Z95 * deviation < DETERMINED_HALF_WIDTH * np.abs(values))
    np.testing.assert_array_equal([why is None for why in undetermined(bound, values, NAMES)], known)


def test_names_run_over_the_terms_of_each_joint() -> None:
    names = term_names(("I", "II"))
    assert len(names) == 24
    assert (names[0], names[5], names[12], names[-1]) == ("k11(I)", "k33(I)", "k11(II)", "h33(II)")


def test_a_weak_difference_has_the_deviation_of_the_sum_with_it() -> None:
    covariance = 1e-6 * np.eye(24)
    covariance[np.ix_([0, 12], [0, 12])] += 26.0**2 / 4 * np.array([[1, -1], [-1, 1]])
    values = np.full(24, 100.0)
    (found,) = weak_directions(covariance, ("I", "II"), np.ones((3, 3)), values)
    assert found.terms == (("k11(I)", 1.0), ("k11(II)", -1.0))
    assert found.standard_deviation == pytest.approx(26.0)
    assert found.reversed_deviation == pytest.approx(np.sqrt(2e-6))


@pytest.mark.parametrize(("place", "name"), [(9, "h22(3)"), (1, "k12(3)"), (4, "k23(3)"), (5, "k33(3)")])
def test_a_single_weak_term_is_named_alone(place: int, name: str) -> None:
    covariance = 1e-6 * np.eye(12)
    covariance[place, place] = 9.0
    (found,) = weak_directions(covariance, ("3",), np.ones((3, 3)), np.full(12, 10.0))
    assert found.terms == ((name, 1.0),)
    assert found.standard_deviation == pytest.approx(3.0)
    assert found.reversed_deviation is None


def test_a_well_determined_joint_has_no_weak_direction() -> None:
    assert weak_directions(1e-6 * np.eye(12), ("I",), np.ones((3, 3)), np.full(12, 10.0)) == ()


def test_a_difference_is_told_even_where_it_is_small_if_the_sum_is_known_far_better() -> None:
    covariance = np.diag(np.full(24, 1e-8))
    covariance[np.ix_([0, 12], [0, 12])] += np.array([[1, -1], [-1, 1]])
    (found,) = weak_directions(covariance, ("I", "II"), np.ones((3, 3)), np.full(24, 100.0))
    assert found.terms == (("k11(I)", 1.0), ("k11(II)", -1.0))


def test_several_terms_that_go_together_are_one_direction() -> None:
    covariance = 1e-6 * np.eye(12)
    covariance[np.ix_([1, 4, 5], [1, 4, 5])] += 9.0
    (found,) = weak_directions(covariance, ("I",), np.ones((3, 3)), np.full(12, 10.0))
    assert found.terms == (("k12(I)", 1.0), ("k23(I)", 1.0), ("k33(I)", 1.0))
    assert found.standard_deviation == pytest.approx(9.0)
    assert found.reversed_deviation is None


def test_the_cause_that_leaves_the_wider_interval_is_named() -> None:
    values, drawn = np.full(3, 7.0), np.diag([1.0, 1.0, 0.01])
    names = ("k11(I)", "k22(I)", "k33(I)")
    alike = TermBound(drawn, np.diag([1.1, 400.0, 400.0])).undetermined(values, names)
    assert [why.left_by for why in alike] == [LeftBy.DATA, LeftBy.TOLERANCES, LeftBy.TOLERANCES]
    by_data = TermBound(drawn, drawn).undetermined(values, names)
    assert [why and why.left_by for why in by_data] == [LeftBy.DATA, LeftBy.DATA, None]
    known_in_a_sum = drawn.copy()
    known_in_a_sum[0, 1] = known_in_a_sum[1, 0] = -0.9999
    first, *_ = TermBound(known_in_a_sum, np.diag([400.0, 400.0, 400.0])).undetermined(values, NAMES[:3])
    assert first == KnownInSum("k11(I)", "k11(II)", is_sum=True, weighted=False)
