"""A filled form becomes a sequence, or a sentence that says what is wrong with it."""

from importlib import resources

import pytest

from jointlab.errors import JointlabError
from jointlab.sequences.form import form_of, numbers, sequence_of_form
from rig.sequences.sequence import HammerStep, Sequence, SequenceError, SweepStep
from rig.sequences.sequence_file import load_sequence


@pytest.fixture
def paper() -> Sequence:
    with resources.as_file(resources.files("jointlab.sequences") / "paper.yaml") as path:
        return load_sequence(path)


def test_the_form_of_a_sequence_makes_the_same_sequence(paper: Sequence) -> None:
    assert sequence_of_form(paper, "", form_of(paper)) == paper


def test_a_part_is_measured_as_the_form_says(paper: Sequence) -> None:
    form = form_of(paper) | {"points": "1y 3y", "blows": "3", "title": "Two points"}
    (step,) = sequence_of_form(paper, "hammer", form).steps
    assert isinstance(step, HammerStep)
    assert (step.points, step.blows) == (("1y", "3y"), 3)


def test_decimals_are_read_after_a_point_and_after_a_comma(paper: Sequence) -> None:
    form = form_of(paper) | {"amplitudes": "0,1 0.05; 0,01", "frequencies": "10 20 2,5"}
    (step,) = sequence_of_form(paper, "sweep", form).steps
    assert isinstance(step, SweepStep)
    assert step.amplitudes_pp_mm == (0.1, 0.05, 0.01)
    assert step.frequencies.values == (10.0, 12.5, 15.0, 17.5, 20.0)


@pytest.mark.parametrize(
    ("choice", "said"),
    [
        ({"blows": "2.5"}, "not a whole number"),
        ({"blows": "1"}, "it has to be 2 or more"),
        ({"points": "3z"}, "3z"),
        ({"points": "1y 99y"}, "^points: no node for 99y"),  # by the field, and not by its place in the document
        ({"amplitudes": "much"}, "is not a list of numbers"),
        ({"frequencies": "5 200"}, "give the first, the last and the step"),
        ({"specimens": "III"}, "no joint III"),
    ],
)
def test_a_form_that_cannot_be_measured_is_explained(paper: Sequence, choice: dict[str, str], said: str) -> None:
    with pytest.raises((JointlabError, SequenceError), match=said):
        sequence_of_form(paper, "", form_of(paper) | choice)


@pytest.mark.parametrize("text", ["0.1 0.05", "0.1, 0.05", "0,1 0,05", "0,1; 0,05", "0.1;0.05"])
def test_numbers_are_read_with_either_decimal_mark_and_separator(text: str) -> None:
    assert numbers(text, "amplitudes") == [0.1, 0.05]


def test_a_text_without_numbers_is_named_by_its_field() -> None:
    with pytest.raises(JointlabError, match="amplitudes"):
        numbers("0.1mm", "amplitudes")
