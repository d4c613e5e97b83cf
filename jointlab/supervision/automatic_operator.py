"""An operator that is a program, such as that of a simulated bench, beside the prompts of a drive process."""

import logging
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Protocol

from analysis.dof import Dof
from jointlab.drive.events import PromptKind
from jointlab.drive.prompts import Prompt
from rig.errors import RigError
from rig.events import Event
from rig.operator import Operator

log = logging.getLogger(__name__)


class AutomaticOperator(Operator, Protocol):
    """An operator that needs no prompt, and observes the sequence."""

    def observe(self, event: Event) -> None:
        """Receive an event of the sequence."""


def obey(operator: Operator, prompt: Prompt) -> None:
    """Do what a prompt asks for. Raises RigError where the operator cannot."""
    match prompt.kind, prompt.subject:
        case PromptKind.GO, (point,):
            operator.go_to(Dof.parse(point))
        case PromptKind.STRIKE, (point, blow):
            operator.strike(Dof.parse(point), int(blow))
        case PromptKind.MOUNT, (specimen, configuration):
            operator.mount(specimen, configuration)
        case _:
            operator.do_task(prompt.text)


class Obeying:
    """Lets an operator obey prompts in a thread of its own, one after the other.

    Args:
        obey: does what a prompt asks for, and answers it.
        fail: is told of a prompt that the operator cannot obey, and why.
    """

    def __init__(self, obey: Callable[[Prompt], object], fail: Callable[[Prompt, str], object]) -> None:
        self._obey = obey
        self._fail = fail
        self._prompts = SimpleQueue[Prompt | None]()  # a run has one open prompt at a time
        self._thread = threading.Thread(target=self._run, name="automatic operator", daemon=True)
        self._thread.start()

    def __call__(self, prompt: Prompt) -> None:
        """Obey `prompt` soon."""
        self._prompts.put(prompt)

    def close(self) -> None:
        """End after the present prompt."""
        self._prompts.put(None)
        self._thread.join()

    def _run(self) -> None:
        while (prompt := self._prompts.get()) is not None:
            try:
                self._obey(prompt)
            except RigError as error:
                try:
                    self._fail(prompt, str(error))
                except Exception as other:  # noqa: BLE001 - the run has ended meanwhile, or its process
                    log.info("prompt %s: %s", prompt.number, other)
            except Exception as error:  # noqa: BLE001 - as above
                log.info("prompt %s: %s", prompt.number, error)
