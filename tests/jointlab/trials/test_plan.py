"""Which cases a trial has."""

from collections import Counter

from jointlab.trials.plan import CYCLE, plan
from simlab.case.draw import EFFECTS, NOVELTIES, CaseKind


def test_every_effect_comes_before_any_comes_twice() -> None:
    cases = plan(400, 3)
    singles = [case.effects[0] for case in cases if case.kind is CaseKind.SINGLE]
    assert set(singles[: len(EFFECTS)]) == set(EFFECTS)
    assert max(Counter(singles).values()) - min(Counter(singles).values()) <= 1
    novel = [case.effects[0] for case in cases if case.kind is CaseKind.NOVEL]
    assert set(novel[: len(NOVELTIES)]) == set(NOVELTIES)


def test_a_trial_has_all_kinds_in_their_shares() -> None:
    kinds = Counter(case.kind for case in plan(400, 3))
    assert kinds == {kind: 50 * CYCLE.count(kind) for kind in CaseKind}


def test_a_longer_trial_begins_with_the_shorter_one_and_another_seed_is_another() -> None:
    assert plan(40, 3)[:8] == plan(8, 3)
    assert {case.seed for case in plan(40, 3)}.isdisjoint(case.seed for case in plan(40, 4))


def test_some_singles_are_tried_without_their_effect() -> None:
    again = [case for case in plan(64, 3, honesty=4) if case.without_truth]
    assert len(again) == 10
    assert {case.kind for case in again} == {CaseKind.SINGLE}
    assert not any(case.without_truth for case in plan(64, 3, honesty=0))
