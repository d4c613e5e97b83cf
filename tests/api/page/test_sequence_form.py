"""What a technician asks for becomes a sequence, or a sentence that says what is wrong with it."""

from __future__ import annotations

from importlib import resources

import pytest

from api.page.sequence_form import choices_of, numbers, wanted_sequence
from jointlab.errors import JointlabError
from rig.sequence import HammerStep, Sequence, SequenceError, SweepStep, load_sequence


@pytest.fixture
def paper() -> Sequence:
    with resources.as_file(resources.files("jointlab.sequences") / "paper.yaml") as path:
        return load_sequence(path)


def test_the_choices_of_a_sequence_make_the_same_sequence_again(paper: Sequence) -> None:
    assert wanted_sequence(paper, "", choices_of(paper)) == paper


def test_a_part_is_measured_with_what_was_chosen(paper: Sequence) -> None:
    choices = choices_of(paper) | {"points": "1y 3y", "blows": "3", "title": "Two points"}
    (step,) = wanted_sequence(paper, "hammer", choices).steps
    assert isinstance(step, HammerStep)
    assert (step.points, step.blows) == (("1y", "3y"), 3)


def test_decimals_are_read_after_a_point_and_after_a_comma(paper: Sequence) -> None:
    choices = choices_of(paper) | {"amplitudes": "0,1 0.05; 0,01", "frequencies": "10 20 2,5"}
    (step,) = wanted_sequence(paper, "sweep", choices).steps
    assert isinstance(step, SweepStep)
    assert step.amplitudes_pp_mm == (0.1, 0.05, 0.01)
    assert step.frequencies.values == (10.0, 12.5, 15.0, 17.5, 20.0)


@pytest.mark.parametrize(
    ("choice", "said"),
    [
        ({"blows": "2.5"}, "no whole number"),
        ({"blows": "1"}, "greater than or equal to 2"),
        ({"points": "3z"}, "3z"),
        ({"amplitudes": "much"}, "are no numbers"),
        ({"frequencies": "5 200"}, "give the first, the last and the step"),
        ({"specimens": "III"}, "no joint III"),
    ],
)
def test_what_cannot_be_measured_is_said(paper: Sequence, choice: dict[str, str], said: str) -> None:
    with pytest.raises((JointlabError, SequenceError), match=said):
        wanted_sequence(paper, "", choices_of(paper) | choice)


def test_no_numbers_are_said_where_there_are_none() -> None:
    with pytest.raises(JointlabError, match="amplitudes"):
        numbers("0.1mm", "amplitudes")
