"""What a score stands for."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.gap.parameter import Parameter

SCORES = st.floats(-8.0, 8.0)
CENTRES = st.floats(1e-9, 1e9)
SPREADS = st.floats(1e-3, 2.0)


@given(CENTRES, SPREADS)
def test_no_score_is_the_centre(centre: float, spread: float) -> None:
    for positive in (False, True):
        assert Parameter("k", "N/m", centre, spread, positive).value(0.0) == centre


@given(st.floats(-1e3, 1e3), SPREADS, SCORES)
def test_a_score_counts_spreads_from_the_centre(centre: float, spread: float, score: float) -> None:
    value = Parameter("tau", "s", centre, spread).value(score)
    assert value - centre == pytest.approx(score * spread, abs=1e-9)


@given(CENTRES, SPREADS, SCORES)
def test_a_positive_parameter_stays_positive_and_opposite_scores_are_inverse_ratios(
    centre: float, spread: float, score: float
) -> None:
    parameter = Parameter("k", "N/m", centre, spread, positive=True)
    above, below = parameter.value(score), parameter.value(-score)
    assert above > 0
    assert below > 0
    assert above / centre == pytest.approx(centre / below)


@given(CENTRES, SPREADS, SCORES, st.floats(1e-3, 1.0), st.booleans())
def test_the_value_rises_with_the_score(
    centre: float, spread: float, score: float, further: float, positive: bool
) -> None:
    parameter = Parameter("k", "N/m", centre, max(spread, 1e-6 * centre) if not positive else spread, positive)
    assert parameter.value(score + further) > parameter.value(score)


@given(CENTRES, SPREADS, SCORES)
def test_the_relative_change_of_a_score_changes_a_size_by_its_share(centre: float, spread: float, score: float) -> None:
    for parameter in (Parameter("k", "N/m", centre, spread, positive=True), Parameter("m", "kg", 0.0, spread)):
        changed = parameter.value(score + 1e-6 * parameter.relative(score))
        assert changed == pytest.approx(parameter.value(score) * (1 + 1e-6), rel=1e-9)


def test_a_place_and_a_share_about_one_have_no_relative_change() -> None:
    """Two per cent of a distance from the left end would tell nothing of how well it is known."""
    assert Parameter("position", "m", 0.4, 0.1).relative(2.0) == 0.0
    assert Parameter("share", "1", 1.0, 0.2).relative(2.0) == 0.0
    assert Parameter("f", "Hz", 100.0, 0.0, positive=True).relative(2.0) == 0.0
