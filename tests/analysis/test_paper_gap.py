import numpy as np
import pytest

from tests.bench.bench_paper_gap import (
    DOMINANT,
    EVERY,
    MIDPOINTS,
    NINE,
    SIX,
    Problem,
    absolute_test,
    fit,
    likeness,
    theory_inset,
)
from tests.bench.paper_bench import BEAM, FREE, PUBLISHED_THEORY, SUPPORTED, PaperBench


@pytest.fixture(scope="module")
def problem() -> Problem:
    inset, spread = theory_inset()
    return Problem.at(PaperBench(inset), spread)


def test_the_printed_theory_places_the_joint_nodes(problem: Problem) -> None:
    assert problem.bench.inset / BEAM.length == pytest.approx(0.0656, abs=0.0005)
    np.testing.assert_allclose(problem.centre[SIX], PUBLISHED_THEORY, rtol=0.012)
    np.testing.assert_allclose(problem.centre[SUPPORTED.size :], FREE, rtol=0.007)


def test_the_gap_is_beyond_what_the_dominant_intervals_allow_and_within_what_all_of_table_2_allows(
    problem: Problem,
) -> None:
    assert absolute_test(problem, SIX, MIDPOINTS)[1] < 1e-6
    assert absolute_test(problem, SIX, DOMINANT)[1] < 1e-3
    assert absolute_test(problem, SIX, EVERY)[1] > 0.5


def test_a_softer_bar_explains_six_frequencies_until_the_free_bar_is_asked(problem: Problem) -> None:
    six, nine = (
        fit(problem, ("modulus",), rows).log_evidence - fit(problem, (), rows).log_evidence for rows in (SIX, NINE)
    )
    assert six > 3
    assert nine < 0


def test_rotational_stiffness_below_the_midpoints_explains_most_of_nine(problem: Problem) -> None:
    found = fit(problem, ("k33(I)", "k33(II)"), NINE)
    assert found.log_evidence - fit(problem, (), NINE).log_evidence > 5
    assert np.all(found.mean < 0)
    assert np.all(np.abs(found.residual[:2]) < 0.002)  # of modes 1 and 2, 1.9 and 3.1 % before
    assert absolute_test(problem, NINE, DOMINANT)[1] < 1e-5
    assert 0.01 < absolute_test(problem, NINE, DOMINANT | {"k33"})[1] < 0.05  # and does not explain the rest


def test_modulus_and_density_are_twins_on_six_frequencies(problem: Problem) -> None:
    assert likeness(problem, ("modulus",), ("density",)) > 0.98


def test_common_stiffness_factors_cannot_be_told_apart(problem: Problem) -> None:
    assert likeness(problem, ("temperature",), ("preload",)) == pytest.approx(1.0, abs=1e-3)
