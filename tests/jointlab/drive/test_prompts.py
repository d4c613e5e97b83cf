"""A run that waits for its operator: hold and its end are told there, too."""

import threading

import pytest

from analysis.dof import Direction, Dof
from jointlab.drive.events import OperatorAnswered, OperatorAsked
from jointlab.drive.prompts import PromptingOperator
from rig.events import Event, RunPaused, RunResumed
from tests.waiting import until


@pytest.mark.parametrize("when", ["while it waits", "before it asks"])
def test_hold_is_told_at_a_prompt_and_the_prompt_stays(when: str) -> None:
    events = list[Event]()
    operator = PromptingOperator(events.append)
    waiting = threading.Thread(target=operator.mount, args=("I", "shear"))
    if when == "before it asks":
        operator.hold(lambda: False)
    waiting.start()
    until(lambda: operator.prompt is not None)
    if when == "while it waits":
        operator.hold(lambda: False)
        operator.hold(lambda: False)  # pressed twice
    until(lambda: RunPaused(False) in events)
    prompt = operator.prompt
    assert prompt is not None
    operator.go_on()
    assert operator.prompt is prompt
    operator.answer(prompt.number)
    waiting.join()
    assert [type(event) for event in events] == [OperatorAsked, RunPaused, RunResumed, OperatorAnswered]


def test_hold_at_a_blow_is_told_by_the_run_itself() -> None:
    events = list[Event]()
    operator = PromptingOperator(events.append)
    operator.strike(Dof(1, Direction.Y), 1)
    operator.hold(lambda: False)
    operator.go_on()
    assert [type(event) for event in events] == [OperatorAsked]
