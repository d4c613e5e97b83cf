"""A trial of one's own simulator: cases that can be distinguished are named, and its score limits what is told."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, cast

import numpy as np
import pytest

from analysis.frequency_response import Complex
from analysis.gap.effect import Given, Mechanism
from analysis.gap.evidence.verdict import Status
from analysis.gap.parameter import Parameter
from analysis.gap.structures.callable_simulator import CallableSimulator
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.effect import StructureEffect, Variant
from analysis.gap.structures.search import Failure
from jointlab.errors import JointlabError
from jointlab.structures.plug_ins import simulator_named
from jointlab.structures.trial import STRONG, CaseScore, never_tried, read_record, trial_document, try_cases

EXAMPLES = Path(__file__).resolve().parents[3] / "docs" / "examples"
PENDULUM = cast("CallableSimulator", simulator_named(f"{EXAMPLES / 'own_simulator.py'}:pendulum"))
SPRING, OWN_MASS = PENDULUM.parameters


@dataclass(frozen=True)
class At(StructureEffect):
    """Every second reading is off, the even or the odd ones."""

    id: ClassVar[str] = "at"
    title: ClassVar[str] = "readings are off"
    mechanism: ClassVar[Mechanism] = Mechanism.MEASURING_CHAIN
    form_is_known: ClassVar[bool] = True
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("share", "1", 0.0, 0.1),)
    place_of_value: int = 0

    def reading(self, given: Given, values: Complex, curve: Curve) -> Complex:
        own = np.arange(values.size) % 2 == self.place_of_value
        return np.asarray(values * np.where(own, 1 + given["share"], 1.0))


class NeverRuns(At):
    id = "never_runs"

    def reading(self, given: Given, values: Complex, curve: Curve) -> Complex:
        raise ZeroDivisionError("three by nothing")


class Many(At):
    id = "many"
    own_parameters = tuple(Parameter(f"share_{n}", "1", 0.0, 1e-3) for n in range(40))

    def reading(self, given: Given, values: Complex, curve: Curve) -> Complex:
        return np.asarray(values * (1 + sum(given.values())))


def template() -> list[Curve]:
    mass = np.linspace(0.5, 3.0, 8)
    return [
        Curve("frequency", f"{warm:g}", np.ones(8), np.full(8, 2e-3), {"mass": mass, "temperature": np.full(8, warm)})
        for warm in (10.0, 20.0, 30.0, 40.0)
    ]


def test_cases_with_a_clear_effect_are_named_and_those_without_are_not() -> None:
    found = try_cases(PENDULUM, template(), 30, 1)
    document = trial_document(found, PENDULUM, PENDULUM.effects([]), 1)
    assert document["strong"]["cases"] >= 10
    assert document["strong"]["named"] >= 0.9 * document["strong"]["cases"]
    assert document["none"]["cases"] >= 3
    assert document["none"]["false_alarms"] <= 1


def test_the_same_seed_draws_the_same_cases() -> None:
    first, second = (try_cases(PENDULUM, template(), 4, 3) for _ in range(2))
    assert [(each.truth, each.strength) for each in first] == [(each.truth, each.strength) for each in second]


def scores(**changes: Any) -> dict[str, Any]:
    return trial_document([], PENDULUM, PENDULUM.effects([]), 1) | changes


def test_scores_are_read_as_they_were_published(tmp_path: Path) -> None:
    (tmp_path / "scores.json").write_text(json.dumps(scores()), encoding="utf-8")
    assert read_record(tmp_path / "scores.json", PENDULUM, PENDULUM.effects([])) == scores()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "the whole: Invalid JSON"),
        ("[]", "the whole: Input should be an object"),
        ('{"format": "jointlab-structure-trial/1"}', "simulator: Field required"),
        (json.dumps(scores(strong={"cases": 3})), "strong.named: Field required"),
        (json.dumps(scores(none={"cases": 3, "false_alarms": "few"})), "none.false_alarms: Input should be"),
        (json.dumps(scores(strong={"cases": 3, "named": 5})), "more cases are counted than there are"),
        (json.dumps(scores(format="another")), "format: Input should be"),
        (json.dumps(scores(simulator="another")), "is of the simulator 'another', not of 'mass on a spring'"),
    ],
)
def test_a_file_that_lacks_scores_is_refused_with_what_it_lacks(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "scores.json").write_text(text, encoding="utf-8")
    with pytest.raises(JointlabError, match=said):
        read_record(tmp_path / "scores.json", PENDULUM, PENDULUM.effects([]))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"parameters": PENDULUM.parameters[:1]}, "other parameters than simulator 'mass on a spring' has now"),
        ({"parameters": (replace(SPRING, centre=1001.0), OWN_MASS)}, "other parameters"),
        ({"parameters": (replace(SPRING, spread=0.06), OWN_MASS)}, "other parameters"),
        ({"parameters": (replace(SPRING, name="leaf"), OWN_MASS)}, "other parameters"),
        ({"local": (Parameter("gain", "1", 0.0, 0.01),)}, "other parameters"),
        ({"candidates": ()}, "of the effects warm_spring; this diagnosis tries none"),
        ({"candidates": (*PENDULUM.candidates, At(1))}, "this diagnosis tries at, warm_spring; run"),
    ],
)
def test_scores_of_a_simulator_that_has_changed_since_are_refused(
    tmp_path: Path, changes: dict[str, Any], said: str
) -> None:
    (tmp_path / "scores.json").write_text(json.dumps(scores()), encoding="utf-8")
    now = replace(PENDULUM, **changes)
    with pytest.raises(JointlabError, match=said):
        read_record(tmp_path / "scores.json", now, now.effects([]))


def case(variant: Variant, *told: Variant, answer: tuple[str, ...] = ("at",)) -> CaseScore:
    return CaseScore("at", 20.0, answer, Status.EXPLAINED, 0.9, 1.0, "at (the only one)", variant, told)


@pytest.mark.parametrize(
    ("one", "named"),
    [
        (case({"place": "a"}, {"place": "a"}), True),
        (case({"place": "a"}, {"place": "b"}), False),
        (case({"place": "a"}, {"place": "b"}, {"place": "a"}), True),  # the verdict says that it cannot tell
        (case({"place": "a"}, {"sensor": "angle"}), True),  # another law of the effect, which has no place
        (case({}, {}), True),
        (case({}, {}, answer=("at", "warm")), False),
    ],
)
def test_an_effect_at_another_place_is_not_named(one: CaseScore, named: bool) -> None:
    assert one.named is named
    assert scores_of(one)["strong"] == {"cases": 1, "named": int(named)}


def scores_of(*found: CaseScore) -> dict[str, Any]:
    return trial_document(found, PENDULUM, PENDULUM.effects([]), 1)


def test_a_trial_knows_the_place_of_each_case_and_the_place_of_each_verdict() -> None:
    found = try_cases(replace(PENDULUM, candidates=(At(0), At(1))), template(), 12, 2)
    clear = [each for each in found if each.truth and each.strength >= STRONG]
    assert {each.variant["place_of_value"] for each in clear} == {0, 1}
    assert all(each.named for each in clear)


def test_effects_that_fail_in_every_draw_or_in_every_case_are_told() -> None:
    found = try_cases(replace(PENDULUM, candidates=(*PENDULUM.candidates, NeverRuns(), Many())), template(), 8, 1)
    by_effect = {each.effect: each.reason for each in never_tried(found)}
    assert set(by_effect) == {"never_runs (the only one)", "many (the only one)"}
    assert "ZeroDivisionError: three by nothing" in by_effect["never_runs (the only one)"]
    assert "40 parameters for 32 measured values" in by_effect["many (the only one)"]
    told = trial_document(found, PENDULUM, (), 1)["failures"]
    assert {each["effect"] for each in told} == set(by_effect)


def test_an_effect_that_fails_in_some_cases_alone_is_tried() -> None:
    failure = Failure("at (the only one)", "sometimes")
    failing = replace(case({}, {}), failures=(failure,), not_drawn=(failure,))
    assert never_tried([failing, case({}, {})]) == []
