"""Which cases a trial has."""

from collections import Counter

import pytest

from jointlab.trials.plan import CYCLE, PLAIN_CYCLE, plan
from simlab.case.draw import EFFECTS, NOVELTIES, CaseKind
from simlab.case.random_laws import OUTSIDE


@pytest.mark.parametrize(("plain", "outside"), [(True, set(NOVELTIES)), (False, set(OUTSIDE))])
def test_every_effect_comes_before_any_comes_twice(plain: bool, outside: set[str]) -> None:
    cases = plan(400, 3, plain=plain)
    singles = [case.effects[0] for case in cases if case.kind is CaseKind.SINGLE]
    assert set(singles[: len(EFFECTS)]) == set(EFFECTS)
    assert max(Counter(singles).values()) - min(Counter(singles).values()) <= 1
    novel = [case.effects[0] for case in cases if case.kind is CaseKind.NOVEL]
    assert set(novel[: len(outside)]) == outside


def test_a_trial_has_all_kinds_in_their_shares() -> None:
    assert Counter(case.kind for case in plan(400, 3)) == {kind: 25 * CYCLE.count(kind) for kind in CaseKind}
    plain = Counter(case.kind for case in plan(400, 3, plain=True))
    assert plain == {kind: 50 * PLAIN_CYCLE.count(kind) for kind in set(PLAIN_CYCLE)}


def test_a_longer_trial_begins_with_the_shorter_one_and_another_seed_is_another() -> None:
    assert plan(40, 3)[:8] == plan(8, 3)
    assert {case.seed for case in plan(40, 3)}.isdisjoint(case.seed for case in plan(40, 4))
