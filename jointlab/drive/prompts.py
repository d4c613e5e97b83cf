"""The operator behind a page, a terminal or a program: asked by a prompt, and waited for until it is answered."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

from analysis.dof import Dof
from jointlab.drive.events import OperatorAnswered, OperatorAsked, PromptKind
from jointlab.errors import ConflictError
from rig.errors import RequestError, RunStoppedError
from rig.events import Observer, RunPaused, RunResumed
from rig.operator import Operator, mounting_text, points_text

HOLD_EACH = "hold each for 120 cycles and 5 s at least"
"""Long enough for a look and a record, whenever they begin."""


@dataclass(frozen=True)
class Prompt:
    """A request to the operator.

    Attributes:
        number: to answer it with.
        kind: what it asks for.
        text: the request as a sentence, to show.
        waits: whether the run waits for the answer; a blow and a sine point are detected without one.
        subject: what it is about: the point, and for a blow its number; the specimen and its configuration; or the
            preset, and amplitude and frequency of each sine point in turn.
    """

    number: int
    kind: PromptKind
    text: str
    waits: bool
    subject: tuple[str, ...] = ()


class PromptingOperator(Operator):
    """Asks by prompts. Every request raises RunStoppedError where the run is to stop, and RequestError where the
    operator cannot do it.

    Args:
        numbers: of the prompts; none comes twice, also in another run.
    """

    def __init__(self, observer: Observer, numbers: Iterator[int]) -> None:
        self._observer = observer
        self._changed = threading.Condition()
        self._prompt: Prompt | None = None
        self._numbers = numbers
        self._answered: int | None = None
        self._released = False
        self._failure: str | None = None
        self._pressure: Callable[[], bool | None] | None = None  # while the run is paused
        self._held_since: float | None = None  # of the open prompt

    @property
    def prompt(self) -> Prompt | None:
        """The open prompt."""
        return self._prompt

    def answer(self, number: int) -> None:
        """Confirm that prompt `number` is done; the run goes on.

        Raises ConflictError where prompt `number` is not open.
        """
        with self._changed:
            self._check_open(number)
            self._answered = number
            self._clear()

    def fail(self, number: int, reason: str) -> None:
        """Say that the operator cannot do what prompt `number` asks for; the run fails at its next prompt, or at this.

        Raises ConflictError where prompt `number` is not open.
        """
        with self._changed:
            self._check_open(number)
            self._failure = reason
            self._clear()

    @property
    def failure(self) -> str | None:
        """Why the operator cannot go on; None where that was not said."""
        return self._failure

    def hold(self, pressure: Callable[[], bool | None]) -> None:
        """Show that the run is paused, also while it waits for an answer and does not notice it.

        Args:
            pressure: see `RunControl.has_pressure`.

        Raises:
            RigError: what `pressure` raises.
        """
        with self._changed:
            self._pressure = pressure
            self._tell_hold()

    def go_on(self) -> None:
        """Show that the run goes on, if it still waits for an answer."""
        with self._changed:
            self._pressure = None
            if self._held_since is not None:
                self._observer(RunResumed(time.monotonic() - self._held_since))
                self._held_since = None

    def release(self) -> None:
        """End all waiting: the run is to stop."""
        with self._changed:
            self._released = True
            self._clear()

    def go_to(self, point: Dof) -> None:
        """Ask for the hammer at `point`, and wait until it is there."""
        self._ask(PromptKind.GO, f"take the hammer to {point}", (str(point),))

    def strike(self, point: Dof, blow: int) -> None:
        """Ask for a blow at `point`; the trigger waits for it."""
        self._ask(PromptKind.STRIKE, f"strike {point} (blow {blow})", (str(point), str(blow)), waits=False)

    def end_striking(self) -> None:
        """Ask for no blow any more."""
        with self._changed:
            self._clear()

    def mount(self, specimen: str, configuration: str) -> None:
        """Ask for a specimen, or the beam, to be mounted, and wait until it is."""
        text = f"mount {mounting_text(specimen, configuration)}, and step back"
        self._ask(PromptKind.MOUNT, text, (specimen, configuration))

    def run_points(self, preset: float, points: Sequence[tuple[float, float]]) -> None:
        """Ask for `points` of the machine's own software; the recorder waits for them."""
        if points:
            text = f"let the machine's own software run, in any order, {points_text(preset, points)}; {HOLD_EACH}"
            subject = map(repr, (preset, *chain.from_iterable(points)))
            self._ask(PromptKind.POINTS, text, tuple(subject), waits=False)
        else:
            with self._changed:
                self._clear()

    def offer(self, text: str) -> Callable[[], bool]:
        """Offer `text`, which is accepted by the answer."""
        offered = self._ask(PromptKind.TASK, text, (), is_offer=True)

        def is_accepted() -> bool:
            with self._changed:
                self._check_may_go_on()
                return self._answered == offered.number

        return is_accepted

    def do_task(self, text: str) -> None:
        """Ask for the task `text`, and wait until it is done."""
        self._ask(PromptKind.TASK, text, ())

    def _ask(
        self, kind: PromptKind, text: str, subject: tuple[str, ...], *, waits: bool = True, is_offer: bool = False
    ) -> Prompt:
        with self._changed:
            self._clear()
            self._check_may_go_on()
            prompt = self._prompt = Prompt(next(self._numbers), kind, text, waits, subject)
            self._observer(OperatorAsked(prompt.number, kind, text))
            if waits and not is_offer:
                self._tell_hold()
                self._changed.wait_for(lambda: self._prompt is not prompt)
                self._check_may_go_on()
            return prompt

    def _tell_hold(self) -> None:
        waits = self._prompt is not None and self._prompt.waits
        if waits and self._pressure is not None and self._held_since is None:
            self._held_since = time.monotonic()
            self._observer(RunPaused(self._pressure()))

    def _check_open(self, number: int) -> None:
        if self._prompt is None or self._prompt.number != number:
            asked = "nothing is" if self._prompt is None else self._prompt.text
            raise ConflictError(f"prompt {number} is not what is asked for now; {asked}")

    def _check_may_go_on(self) -> None:
        if self._released:
            raise RunStoppedError
        if self._failure is not None:
            raise RequestError(self._failure)

    def _clear(self) -> None:
        if self._prompt is not None:
            answered, self._prompt, self._held_since = self._prompt, None, None
            self._observer(OperatorAnswered(answered.number))
            self._changed.notify_all()
