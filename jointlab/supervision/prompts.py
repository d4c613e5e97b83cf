"""The operator behind a page or a program: asked by a prompt, and waited for until it is answered."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Protocol

from analysis.dof import Dof
from jointlab.errors import ConflictError
from jointlab.supervision.events import OperatorAnswered, OperatorAsked
from rig.control import RunStoppedError
from rig.events import Event, Observer
from rig.operator import Operator, mounting_text


@dataclass(frozen=True)
class Prompt:
    """What the operator is asked to do.

    Attributes:
        number: to answer it with.
        kind: go, strike, mount, see to.
        text: a sentence to show.
        waits: whether the run waits for the answer; a blow that is struck is noticed without.
    """

    number: int
    kind: str
    text: str
    waits: bool


class AutomaticOperator(Operator, Protocol):
    """An operator who also watches, such as the hand of a simulated bench."""

    def observe(self, event: Event) -> None:
        """Hear of what the sequence does."""


class PromptingOperator(Operator):
    """Prompts whoever watches. Where there are `hands`, such as those of a simulated bench, they do what is asked for:
    when the prompt is answered, or at once if the run is `automatic`.
    """

    def __init__(self, observer: Observer, hands: AutomaticOperator | None = None, *, automatic: bool = False) -> None:
        self._observer = observer
        self._hands = hands
        self._automatic = automatic and hands is not None
        self._changed = threading.Condition()
        self._prompt: Prompt | None = None
        self._count = 0
        self._released = False

    @property
    def prompt(self) -> Prompt | None:
        """What is asked for now."""
        return self._prompt

    def answer(self, number: int) -> None:
        """It is done; the run goes on.

        Raises:
            ConflictError: prompt `number` is not asked for now.
        """
        with self._changed:
            if self._prompt is None or self._prompt.number != number:
                asked = "nothing is asked for" if self._prompt is None else f"prompt {self._prompt.number} is"
                raise ConflictError(f"prompt {number} is not what is asked for now; {asked}")
            self._clear()

    def release(self) -> None:
        """Wait for nobody any more: the run is to stop."""
        with self._changed:
            self._released = True
            self._clear()

    def go_to(self, point: Dof) -> None:
        """Ask for the hammer at `point`, and wait until it is there.

        Raises:
            RunStoppedError: the run is to stop.
        """
        if not self._automatic:
            self._ask("go", f"take the hammer to {point}", waits=True)

    def strike(self, point: Dof, blow: int) -> None:
        """Ask for a blow at `point`.

        Raises:
            RunStoppedError: the run is to stop.
        """
        if not self._automatic:
            self._ask("strike", f"strike {point} (blow {blow})", waits=self._hands is not None)
        if self._hands is not None:
            self._hands.strike(point, blow)

    def mount(self, specimen: str, configuration: str) -> None:
        """Ask for what is to be mounted, and wait until it is.

        Raises:
            RunStoppedError: the run is to stop.
        """
        if not self._automatic:
            self._ask("mount", f"mount {mounting_text(specimen, configuration)}, and step back", waits=True)
        if self._hands is not None:
            self._hands.mount(specimen, configuration)

    def see_to(self, text: str) -> None:
        """Ask for something that takes hands, and wait until it is done.

        Raises:
            RunStoppedError: the run is to stop.
        """
        if not self._automatic:
            self._ask("see to", text, waits=True)

    def _ask(self, kind: str, text: str, *, waits: bool) -> None:
        with self._changed:
            self._clear()
            if self._released:
                raise RunStoppedError("the run was stopped as asked; what was measured before is kept")
            self._count += 1
            prompt = self._prompt = Prompt(self._count, kind, text, waits)
            self._observer(OperatorAsked(prompt.number, kind, text))
            if waits:
                self._changed.wait_for(lambda: self._prompt is not prompt)
                if self._released:
                    raise RunStoppedError("the run was stopped as asked; what was measured before is kept")

    def _clear(self) -> None:
        if self._prompt is not None:
            answered, self._prompt = self._prompt, None
            self._observer(OperatorAnswered(answered.number))
            self._changed.notify_all()
