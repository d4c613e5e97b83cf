"""Halting the machine from a thread of its own, so that the caller does not wait: requests are coalesced."""

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass

from rig.errors import UNEXPECTED, RigError, with_notes

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Halted:
    """The outcome of halting: whether the actuator was confirmed at rest, and a sentence to show.

    `at_rest` is None where the rig drives no tester: nothing is known of a machine then.
    """

    at_rest: bool | None
    detail: str


class Halter:
    """Latches a STOP at once, and halts the machine as often as needed, not as often as asked.

    Args:
        latch: sets the stop latch, given who asks, why, and whether that is a person; it must not block.
        halt: brings the actuator to rest and returns when that is confirmed; raises RigError where it is not.
        is_driven: whether a tester is driven from here, whose actuator `halt` brings to rest.
    """

    def __init__(
        self, latch: Callable[[str, str, bool], object], halt: Callable[[], object], *, is_driven: bool = True
    ) -> None:
        self._latch = latch
        self._is_driven = is_driven
        self._halt = halt
        self._changed = threading.Condition()
        self._asked = 0  # requests so far
        self._done = 0  # requests that a halt which began after them has served
        self._outcome = Halted(False, "nothing was halted yet")
        self._closed = False
        self.finished: Callable[[], object] = lambda: None
        """Called after each halt, from the halting thread; for callers that cannot wait."""
        self._thread = threading.Thread(target=self._run, name="halting", daemon=True)
        self._thread.start()

    def press(self, who: str, why: str = "STOP was pressed", by_person: bool = True) -> int:
        """Latch a STOP and ask for a halt; returns at once, with the number of this request."""
        try:
            self._latch(who, why, by_person)
        finally:  # even if reporting it to others has failed
            with self._changed:
                self._asked += 1
                self._changed.notify_all()
                asked = self._asked
        return asked

    def outcome(self, request: int) -> Halted | None:
        """The outcome of a request; None while halting is under way."""
        with self._changed:
            return self._outcome if self._done >= request else None

    def wait(self, request: int, timeout: float) -> Halted | None:
        """The outcome of a request as soon as it is there; None where that takes longer than `timeout` s."""
        with self._changed:
            self._changed.wait_for(lambda: self._done >= request, timeout)
        return self.outcome(request)

    def close(self) -> None:
        """End the thread after a halt that is under way."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closed or self._asked > self._done)
                if self._asked == self._done:
                    return
                serving = self._asked
            outcome = self._outcome_of_a_halt()
            with self._changed:
                self._done, self._outcome = serving, outcome
                self._changed.notify_all()
            self.finished()

    def _outcome_of_a_halt(self) -> Halted:
        try:
            self._halt()
        except RigError as error:
            return Halted(False, with_notes(str(error), error))
        except Exception as error:
            log.exception("halting ended with an unexpected error")
            return Halted(False, with_notes(UNEXPECTED, error))
        if not self._is_driven:
            return Halted(None, "STOP is in force; this rig drives no tester")
        return Halted(True, "the actuator is at rest")
