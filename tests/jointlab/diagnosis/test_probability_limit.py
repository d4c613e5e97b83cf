"""No probability beyond what trials can resolve."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.gap.diagnosis import Diagnosis, Ranked
from jointlab.diagnosis.probability_limit import limited
from jointlab.diagnosis.track_record import TrackRecord, TrialVerdict
from tests.jointlab.diagnosis.conftest import EFFECT, handmade


def record(right: int, wrong: int, effects: tuple[str, ...] = ("joint_mass",)) -> TrackRecord:
    verdicts = [TrialVerdict("explained", effects, "strong", 0.99, number < right) for number in range(right + wrong)]
    return TrackRecord(400, tuple(verdicts))


def test_the_limit_follows_the_rule_of_succession_on_cases_like_this_one() -> None:
    assert record(48, 0).limit("strong", 1) == pytest.approx(49 / 50)
    assert record(45, 3).limit("strong", 1) == pytest.approx(46 / 50)
    # none was like these: what any number of effects at any gap supports
    assert record(45, 3).limit("faint", 1) == pytest.approx(46 / 50)
    assert record(45, 3).limit("strong", 3) == pytest.approx(46 / 50)
    assert record(48, 0).limit("strong", 0) == 0.5
    assert TrackRecord().limit("strong", 1) == 1.0


def test_probabilities_stay_below_the_limit_and_still_sum_to_one(diagnosis: Callable[..., Diagnosis]) -> None:
    found = limited(diagnosis(), 0.8, 0.85)
    assert found.ranking[0].probability == pytest.approx(0.8)
    assert sum(each.probability for each in found.ranking) == pytest.approx(1.0)
    assert {each.effects: each.probability for each in found.ranking}["unknown",] == pytest.approx(0.03 + 0.13)
    assert found.included[0].probability == 0.85
    assert max(found.mechanisms.values()) == 0.85


def unknown(of_known: float, of_none: float) -> dict[str, Any]:
    """Fields of a diagnosis with an unknown cause, and what is left of probability for an effect and for none."""
    chances = {("unknown",): 1.0 - of_known - of_none, (EFFECT,): of_known, (): of_none}
    included = replace(handmade().included[0], probability=of_known)
    return {
        "ranking": tuple(Ranked(effects, (), chance, None, {}, 0.0) for effects, chance in chances.items()),
        "included": (included,),
        "mechanisms": {included.mechanism: of_known},
    }


def test_what_an_unknown_cause_may_not_have_goes_to_the_explanations_that_are_known() -> None:
    found = limited(handmade(**unknown(of_known=0.18, of_none=0.02)), 0.7, 0.9)
    shares = {each.effects: each.probability for each in found.ranking}
    assert shares == pytest.approx({("unknown",): 0.7, (EFFECT,): 0.27, (): 0.03})
    assert found.included[0].probability == pytest.approx(0.27)
    assert list(found.mechanisms.values()) == pytest.approx([0.27])


def test_where_nothing_that_is_known_has_a_probability_it_goes_to_no_effect() -> None:
    found = limited(handmade(**unknown(of_known=0.0, of_none=0.0)), 0.7, 0.9)
    assert {each.effects: each.probability for each in found.ranking}[()] == pytest.approx(0.3)
    assert found.included[0].probability == 0.0


@given(known=st.floats(0.0, 0.5), none=st.floats(0.0, 0.5), limit=st.floats(0.5, 1.0))
def test_probabilities_sum_to_one_under_any_limit(known: float, none: float, limit: float) -> None:
    found = limited(handmade(**unknown(known, none)), limit, limit)
    assert sum(each.probability for each in found.ranking) == pytest.approx(1.0)
    assert max(each.probability for each in found.ranking) <= max(limit, 0.5) + 1e-9
    assert found.included[0].probability <= limit


def test_modest_numbers_are_left_as_they_are(diagnosis: Callable[..., Diagnosis]) -> None:
    found = diagnosis()
    assert [each.probability for each in limited(found, 0.99, 0.99).ranking] == [
        each.probability for each in found.ranking
    ]


def test_an_effect_of_a_wrong_verdict_may_be_there_all_the_same() -> None:
    one = TrialVerdict("explained", ("joint_mass",), "strong", 0.9, True, claimed=1, there=1)
    pair = TrialVerdict("explained", ("joint_mass", "density"), "strong", 0.9, False, claimed=2, there=1)
    found = TrackRecord(24, (one,) * 20 + (pair,) * 4)
    assert found.limit_of_effects("strong", 1) == pytest.approx(21 / 22)
    assert found.limit_of_effects("strong", 2) == pytest.approx(5 / 10)
    assert found.limit_of_effects("faint", 1) == pytest.approx(25 / 30)  # none was like these: all claims
    # claims were not kept, or never made
    assert record(45, 3).limit_of_effects("strong", 1) == record(45, 3).limit("strong", 1)
    assert TrackRecord().limit_of_effects("strong", 1) == 1.0
