"""The law of the joints in words."""

from collections.abc import Callable, Sequence
from typing import Any

import pytest

from analysis.gap.effect import LawOver
from jointlab.diagnosis import wording
from jointlab.diagnosis.law_text import COORDINATES, law_sentence
from tests.jointlab.diagnosis.conftest import FOLLOWS_AMPLITUDE

Make = Callable[..., dict[str, Any]]
SAME = [1.0, 1.0, 1.0]


def band(value: Sequence[float], half: float) -> dict[str, Any]:
    """A band that is as wide at the end."""
    return {"value": list(value), "ci90": [[value[0], *(each + way * half for each in value[1:])] for way in (-1, 1)]}


def effect(
    stiffness: dict[str, Any], loss: dict[str, Any], over: str = "amplitude", at: Sequence[float] = (1e-6, 3e-6, 1e-5)
) -> dict[str, Any]:
    """An effect that acts alike in shear and compression."""
    axis = {"stiffness": stiffness, "loss_ratio": loss}
    law = {"over": over, "at": list(at), "shear": axis, "compression": axis, "closest_law": ""}
    return {"law": "Kraus", "law_found": law}


def test_what_a_law_depends_on_can_be_said_and_drawn() -> None:
    assert set(COORDINATES) == set(LawOver)


def test_a_law_that_acts_alike_along_both_axes_is_said_once() -> None:
    said = law_sentence(effect(band([1.0, 0.9, 0.82], 0.03), band([1.0, 1.1, 1.25], 0.05)))
    assert said == (
        "joint stiffness falls by 18 % (90 %: 15 to 21) from 1.0 to 10 µm; loss factor rises by 25 % (90 %: 20 to 30); "
        "law: Kraus"
    )


def test_the_closest_known_law_is_said_where_none_is_as_found() -> None:
    bent = effect(band([1.0, 0.9, 0.82], 0.03), band(SAME, 0.0))
    bent["law_found"]["closest_law"] = "Kraus"
    assert law_sentence(bent | {"law": "Kraus, bent"}).endswith("; closest known law: Kraus")


def test_a_change_that_may_be_none_neither_falls_nor_rises() -> None:
    said = law_sentence(effect(band([1.0, 1.0, 0.99], 0.02), band(SAME, 0.0)))
    assert "joint stiffness changes by -1 % (90 %: -3 to 1) from" in said
    assert "loss factor stays the same" in said


@pytest.mark.parametrize(
    ("last", "half", "said"),
    [(0.969, 5e-3, "falls by 3.1 % (90 %: 2.6 to 3.6)"), (0.9969, 5e-4, "falls by 0.31 % (90 %: 0.26 to 0.36)")],
)
def test_a_narrow_interval_has_decimals(last: float, half: float, said: str) -> None:
    assert said in law_sentence(effect(band([1.0, 1.0, last], half), band(SAME, 0.0)))


def test_a_law_that_turns_has_its_highest_place_said() -> None:
    said = law_sentence(effect(band(SAME, 0.0), band([1.0, 1.4, 1.1], 0.02)))
    assert "loss factor rises by 10 % (90 %: 8 to 12) (highest at 3.0 µm: +40 %)" in said
    unsure = law_sentence(effect(band(SAME, 0.0), band([1.0, 1.4, 1.1], 0.35)))
    assert "highest" not in unsure


@pytest.mark.parametrize(
    ("over", "at", "words"),
    [
        ("frequency", (20.0, 100.0, 516.0), "from 20 to 516 Hz"),
        ("order", (0.0, 0.5, 1.0), "from the first to the last point of the test"),
        ("preload", (0.0, 2.5e-4, 5e-4), "from no preload to 0.50 mm"),
        ("temperature", (0.0, 2.0, 4.0), "from the tester's temperature to 4.0 K above it"),
        ("temperature", (-4.0, -2.0, 0.0), "from 4.0 K below the tester's temperature to it"),
    ],
)
def test_the_range_is_that_of_the_data(over: str, at: Sequence[float], words: str) -> None:
    said = law_sentence(effect(band([1.0, 0.9, 0.82], 0.03), band(SAME, 0.0), over, at))
    assert f"falls by 18 % (90 %: 15 to 21) {words};" in said


def test_the_sentence_stands_beside_the_verdict(document: Make) -> None:
    said = wording.beside(document(included=(FOLLOWS_AMPLITUDE,)))
    assert (
        "stiffness and loss that follow amplitude: joint stiffness falls by 20 % (90 %: 18 to 22) in compression and "
        "by 16 % (90 %: 14 to 18) in shear from 1.0 to 10 µm; loss factor rises by 30 % (90 %: 27 to 33); "
        "closest known law: Kraus"
    ) in said


def test_axes_that_change_in_opposite_ways_have_a_verb_each() -> None:
    opposite = effect(band([1.0, 0.9, 0.82], 0.03), band(SAME, 0.0))
    opposite["law_found"]["shear"] = effect(band([1.0, 1.1, 1.25], 0.05), band(SAME, 0.0))["law_found"]["shear"]
    assert (
        "joint stiffness falls by 18 % (90 %: 15 to 21) in compression and rises by 25 % (90 %: 20 to 30) in shear from"
    ) in law_sentence(opposite)


def test_a_diagnosis_without_a_law_of_the_joints_has_no_such_sentence(document: Make) -> None:
    assert not [each for each in wording.beside(document()) if "joint stiffness" in each]
    earlier = document()
    earlier["effects"] = [{name: each[name] for name in each if name != "law_found"} for each in earlier["effects"]]
    assert len(wording.beside(earlier)) == len(wording.beside(document()))
