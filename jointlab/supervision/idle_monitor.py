"""Looking at the tester while nothing is carried out: somebody may press its red button, or pull its plug, meanwhile.

Whoever drives comes first: while they do, nobody looks, and a look that is on its way when they come is one read.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from jointlab.supervision.events import TesterAnswers, TesterSilent
from jointlab.supervision.state import RigState
from rig.errors import RigError
from rig.events import Event, InterlockReset, InterlockTripped, Observer
from rig.registers import name_of
from rig.tester_status import TesterStatus

INTERVAL = 2.0  # s between looks
MISSES = 2  # looks in a row without an answer that are told; one may have been garbled
Seen = TesterStatus | RigError


class IdleWatch:
    """Looks from a thread of its own until it is closed; any thread may keep it off.

    Args:
        look: asks the tester for its status once, in a short and bounded time; raises RigError. None where there is
            no tester to be looked at.
        state: what the rig is known to be at.
        observer: is told what a look has found that `state` has not.
        interval: between looks, s.
    """

    def __init__(
        self,
        look: Callable[[], TesterStatus] | None,
        state: Callable[[], RigState],
        observer: Observer,
        interval: float = INTERVAL,
    ) -> None:
        self._state = state
        self._observer = observer
        self._interval = interval
        self._changed = threading.Condition()
        self._drivers = 0
        self._looking = False
        self._closed = False
        self._thread: threading.Thread | None = None
        if look is not None:
            self._thread = threading.Thread(target=self._watch, args=(look,), name="idle watch", daemon=True)
            self._thread.start()

    @contextmanager
    def kept_off(self) -> Iterator[None]:
        """Leave the tester to the caller while the context lasts; waits for a look that is on its way."""
        with self._changed:
            self._drivers += 1
            self._changed.wait_for(lambda: not self._looking)
        try:
            yield
        finally:
            with self._changed:
                self._drivers -= 1

    def close(self) -> None:
        """Look no more."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        if self._thread is not None:
            self._thread.join()

    def _watch(self, look: Callable[[], TesterStatus]) -> None:
        misses = 0
        while not self._closed:
            with self._looking_on() as may_look:
                if may_look:
                    seen = _seen(look)
                    misses = misses + 1 if isinstance(seen, RigError) else 0
                    self._tell(seen, misses)
            with self._changed:
                self._changed.wait_for(lambda: self._closed, self._interval)

    @contextmanager
    def _looking_on(self) -> Iterator[bool]:
        """Whether nobody drives; whoever wants to then waits until the context is left, however it is left."""
        with self._changed:
            self._looking = not self._drivers
        try:
            yield self._looking
        finally:
            with self._changed:
                self._looking = False
                self._changed.notify_all()

    def _tell(self, seen: Seen, misses: int) -> None:
        with self._changed:
            if not self._drivers and (misses == 0 or misses >= MISSES):
                for event in news(self._state(), seen):
                    self._observer(event)


def _seen(look: Callable[[], TesterStatus]) -> Seen:
    try:
        return look()
    except RigError as error:
        return error


def news(state: RigState, seen: Seen) -> tuple[Event, ...]:
    """What a look at the tester adds to what is known of it; nothing where all is as it was."""
    if isinstance(seen, RigError):
        return () if state.tester_silent else (TesterSilent(str(seen)),)
    answers = (TesterAnswers(),) if state.tester_silent else ()
    stopped_by = tuple(name_of(one) for one in seen.stopped_by)
    if set(stopped_by) - set(state.interlocks):
        return *answers, InterlockTripped(stopped_by, stopped=True)
    if state.interlocks and not stopped_by:
        return *answers, InterlockReset(state.interlocks)  # by somebody else
    return answers
