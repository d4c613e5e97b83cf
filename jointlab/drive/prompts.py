"""The operator behind the page or a program: asked by a prompt, and waited for until the prompt is answered."""

import threading
from dataclasses import dataclass
from typing import Protocol

from analysis.dof import Dof
from jointlab.drive.events import OperatorAnswered, OperatorAsked, PromptKind
from jointlab.errors import ConflictError
from rig.errors import RunStoppedError
from rig.events import Event, Observer
from rig.operator import Operator, mounting_text


@dataclass(frozen=True)
class Prompt:
    """A request to the operator.

    Attributes:
        number: to answer it with.
        kind: what it asks for.
        text: the request as a sentence, to show.
        waits: whether the run waits for the answer; a blow is detected without one.
    """

    number: int
    kind: PromptKind
    text: str
    waits: bool


class AutomaticOperator(Operator, Protocol):
    """An operator that needs no prompt, such as that of a simulated bench, and observes the sequence."""

    def observe(self, event: Event) -> None:
        """Receive an event of the sequence."""


class PromptingOperator(Operator):
    """Asks a person by prompts. An automatic operator, if there is one, does what was asked for: when the prompt is
    answered, or at once if the run is `automatic`. Every request raises RunStoppedError where the run is to stop.
    """

    def __init__(
        self, observer: Observer, automatic_operator: AutomaticOperator | None = None, *, automatic: bool = False
    ) -> None:
        self._observer = observer
        self._automatic_operator = automatic_operator
        self._automatic = automatic and automatic_operator is not None
        self._changed = threading.Condition()
        self._prompt: Prompt | None = None
        self._count = 0
        self._released = False

    @property
    def prompt(self) -> Prompt | None:
        """The open prompt."""
        return self._prompt

    def answer(self, number: int) -> None:
        """Confirm that prompt `number` is done; the run goes on.

        Raises ConflictError where prompt `number` is not open.
        """
        with self._changed:
            if self._prompt is None or self._prompt.number != number:
                asked = "nothing is asked for" if self._prompt is None else f"prompt {self._prompt.number} is"
                raise ConflictError(f"prompt {number} is not what is asked for now; {asked}")
            self._clear()

    def release(self) -> None:
        """End all waiting: the run is to stop."""
        with self._changed:
            self._released = True
            self._clear()

    def go_to(self, point: Dof) -> None:
        """Ask for the hammer at `point`, and wait until it is there."""
        self._ask(PromptKind.GO, f"take the hammer to {point}", waits=True)

    def strike(self, point: Dof, blow: int) -> None:
        """Ask for a blow at `point`."""
        self._ask(PromptKind.STRIKE, f"strike {point} (blow {blow})", waits=self._automatic_operator is not None)
        if self._automatic_operator is not None:
            self._automatic_operator.strike(point, blow)

    def mount(self, specimen: str, configuration: str) -> None:
        """Ask for a specimen, or the beam, to be mounted, and wait until it is."""
        self._ask(PromptKind.MOUNT, f"mount {mounting_text(specimen, configuration)}, and step back", waits=True)
        if self._automatic_operator is not None:
            self._automatic_operator.mount(specimen, configuration)

    def do_task(self, text: str) -> None:
        """Ask for the task `text`, and wait until it is done."""
        self._ask(PromptKind.TASK, text, waits=True)

    def _ask(self, kind: PromptKind, text: str, *, waits: bool) -> None:
        if self._automatic:
            return
        with self._changed:
            self._clear()
            self._check_not_released()
            self._count += 1
            prompt = self._prompt = Prompt(self._count, kind, text, waits)
            self._observer(OperatorAsked(prompt.number, kind, text))
            if waits:
                self._changed.wait_for(lambda: self._prompt is not prompt)
                self._check_not_released()

    def _check_not_released(self) -> None:
        if self._released:
            raise RunStoppedError

    def _clear(self) -> None:
        if self._prompt is not None:
            answered, self._prompt = self._prompt, None
            self._observer(OperatorAnswered(answered.number))
            self._changed.notify_all()
