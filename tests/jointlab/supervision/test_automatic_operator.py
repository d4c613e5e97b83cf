"""The automatic operator beside the prompts of a drive process."""

import threading
from contextlib import ExitStack, suppress

from analysis.dof import Dof
from jointlab.drive.events import PromptKind
from jointlab.drive.prompts import Prompt
from jointlab.drive.protocol import AnswerPrompt, DriveRequest, Snapshot
from jointlab.drive.state import RigState
from jointlab.errors import ConflictError
from jointlab.supervision.automatic_operator import AutomaticOperator, Automation
from rig.events import Event


class SlowOperator(AutomaticOperator):
    """Does each task when it is allowed to."""

    def __init__(self) -> None:
        self.begun, self.may_end = threading.Event(), threading.Event()

    def observe(self, event: Event) -> None:
        """Hear nothing."""

    def strike(self, point: Dof, blow: int) -> None:
        raise AssertionError("no blow is asked for")

    def mount(self, specimen: str, configuration: str) -> None:
        raise AssertionError("nothing is to be mounted")

    def do_task(self, text: str) -> None:
        self.begun.set()
        self.may_end.wait()


def asking(run_id: int, number: int) -> Snapshot:
    return Snapshot(state=RigState(run_id=run_id), prompt=Prompt(number, PromptKind.TASK, "do it", waits=True))


def test_each_prompt_is_answered_for_the_run_that_asked_although_another_one_has_begun_since() -> None:
    asked = list[DriveRequest]()
    operator = SlowOperator()
    automation = Automation(operator, asked.append, lambda: 7)
    with automation.beginning(1, True):
        automation.look(asking(1, 1))
    operator.begun.wait()
    automation.look(asking(1, 2))
    with automation.beginning(2, True):  # run 1 was stopped, run 2 begins
        automation.look(asking(2, 3))
    operator.may_end.set()
    automation.close()
    assert asked == [AnswerPrompt(run_id=run, prompt=number, lease=7) for run, number in ((1, 1), (1, 2), (2, 3))]


def test_the_prompts_of_a_run_that_another_program_has_begun_are_left_to_it() -> None:
    asked = list[DriveRequest]()
    operator = SlowOperator()
    operator.may_end.set()
    automation = Automation(operator, asked.append, lambda: 7)
    with automation.beginning(1, True):
        pass
    assert automation.shown(asking(1, 1)) is None
    automation.look(asking(2, 1))
    shown = automation.shown(asking(2, 1))
    automation.close()
    assert asked == []
    assert shown is not None


def test_a_run_that_cannot_begin_beside_an_automatic_one_leaves_that_automatic() -> None:
    automation = Automation(SlowOperator(), lambda _: None, lambda: 7)
    with ExitStack() as refused:
        refused.enter_context(suppress(ConflictError))
        refused.enter_context(automation.beginning(2, False))
        with automation.beginning(1, True):
            pass  # it is quicker
        raise ConflictError("run 1 is in progress")
    assert automation.shown(asking(1, 1)) is None
    automation.close()
