"""A run that waits for its operator: hold and its end are told there, too."""

import threading
from collections.abc import Sequence
from itertools import count

import pytest

from analysis.dof import Direction, Dof
from jointlab.drive.events import OperatorAnswered, OperatorAsked, PromptKind
from jointlab.drive.prompts import PromptingOperator
from jointlab.errors import ConflictError
from jointlab.supervision.automatic_operator import obey
from rig.errors import RunStoppedError
from rig.events import Event, RunPaused, RunResumed
from rig.operator import Operator
from tests.waiting import until


@pytest.mark.parametrize("when", ["while it waits", "before it asks"])
def test_hold_is_told_at_a_prompt_and_the_prompt_stays(when: str) -> None:
    events = list[Event]()
    operator = PromptingOperator(events.append, count(1))
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
    operator = PromptingOperator(events.append, count(1))
    operator.strike(Dof(1, Direction.Y), 1)
    operator.hold(lambda: False)
    operator.go_on()
    assert [type(event) for event in events] == [OperatorAsked]


def test_an_offer_waits_for_nobody_and_what_is_asked_after_it_takes_it_back() -> None:
    operator = PromptingOperator(lambda event: None, count(1))
    is_accepted = operator.offer("end it")
    first = operator.prompt
    assert first is not None
    assert not is_accepted()
    operator.run_points(5e-4, [(1e-4, 20.0), (3e-5, 48.0)])
    asked = operator.prompt
    assert asked is not None
    assert (asked.kind, asked.waits) == (PromptKind.POINTS, False)
    assert "0.1 mm peak to peak at 20 Hz; 0.03 mm peak to peak at 48 Hz" in asked.text
    assert not is_accepted()
    with pytest.raises(ConflictError):
        operator.answer(first.number)
    assert not is_accepted()
    operator.run_points(5e-4, ())
    assert operator.prompt is None
    is_accepted = operator.offer("end it")
    operator.answer(asked.number + 1)
    assert is_accepted()


def test_an_offer_that_is_open_when_the_run_is_to_stop_raises() -> None:
    operator = PromptingOperator(lambda event: None, count(1))
    is_accepted = operator.offer("end it")
    operator.release()
    with pytest.raises(RunStoppedError):
        is_accepted()


def test_points_come_back_from_a_prompt_as_they_were_asked_for() -> None:
    operator, ran = (
        PromptingOperator(lambda event: None, count(1)),
        list[tuple[float, tuple[tuple[float, float], ...]]](),
    )

    class Machine(Operator):
        def strike(self, point: Dof, blow: int) -> None:
            raise AssertionError("nothing is struck")

        def mount(self, specimen: str, configuration: str) -> None:
            raise AssertionError("nothing is mounted")

        def run_points(self, preset: float, points: Sequence[tuple[float, float]]) -> None:
            ran.append((preset, tuple(points)))

    points = ((1e-4, 20.0), (1 / 3 * 1e-4, 48.1))
    operator.run_points(5e-4, points)
    assert operator.prompt is not None
    obey(Machine(), operator.prompt)
    assert ran == [(5e-4, points)]
