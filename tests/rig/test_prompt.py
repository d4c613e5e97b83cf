"""A task is asked of the operator in its place among the steps, and the sequence waits until it is done."""

from typing import Any

import pytest

from jointlab.runs.carry_out import run_sequence
from rig.control import RunControl
from rig.errors import RunStoppedError
from rig.events import Event, PromptStarted
from rig.instruments import Instruments
from rig.runs.completed_points import CompletedPoint, CompletedPoints
from rig.sequences.sequence import SequenceError, sequence_from
from store.catalogue import Catalogue
from tests.rig.person import Person

TURN = "turn the accelerometer by 90 degrees"


class Handy(Person):
    """Sees to what is asked for."""

    def do_task(self, text: str) -> None:
        self.requests.append(text)


@pytest.fixture
def prompted(document: dict[str, Any]) -> dict[str, Any]:
    """Two blows at 5y before the accelerometer is turned and two afterwards."""
    hammer = document["steps"][0] | {"points": ["5y"], "blows": 2}
    return document | {"steps": [hammer, {"step": "prompt", "text": TURN}, hammer]}


def test_a_prompt_is_asked_after_the_step_before_it_and_before_the_step_after_it(
    prompted: dict[str, Any], instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    handy, events = Handy(person.laboratory), list[Event]()
    run_sequence(sequence_from(prompted), instruments, catalogue, handy, events.append)
    assert handy.requests == ["5y 1", "5y 2", TURN, "5y 1", "5y 2"]
    assert [event for event in events if isinstance(event, PromptStarted)] == [PromptStarted(TURN)]


def test_a_run_that_is_stopped_while_it_asks_does_not_strike_on(
    prompted: dict[str, Any], instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    control = RunControl()

    class Leaving(Handy):
        def do_task(self, text: str) -> None:
            super().do_task(text)
            control.stop()

    leaving = Leaving(person.laboratory)
    with pytest.raises(RunStoppedError):
        run_sequence(sequence_from(prompted), instruments, catalogue, leaving, control=control)
    assert leaving.requests == ["5y 1", "5y 2", TURN]


@pytest.mark.parametrize(("second_set", "left"), [(1, ["prompt", "hammer"]), (2, [])])
def test_a_prompt_is_asked_again_where_the_step_after_it_has_something_left(
    prompted: dict[str, Any], second_set: int, left: list[str]
) -> None:
    measured = CompletedPoints((CompletedPoint(1, "5y", 2, 0, 2), CompletedPoint(2, "5y", second_set, 0, second_set)))
    assert [step.step for step, _ in measured.remaining_steps(sequence_from(prompted))] == left


def test_a_prompt_that_says_nothing_is_refused(prompted: dict[str, Any]) -> None:
    prompted["steps"][1]["text"] = ""
    with pytest.raises(SequenceError, match="text"):
        sequence_from(prompted)
