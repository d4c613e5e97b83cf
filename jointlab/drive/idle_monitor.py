"""Polling the tester while no run drives it, or a run only waits: its plug may be pulled meanwhile.

Driving has precedence. While a run drives the tester, nothing is polled. A poll that is under way when driving begins
is a single read.
"""

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from jointlab.drive.events import TesterAnswers, TesterSilent, UnaskedMotion
from jointlab.drive.state import NOT_READ, RigState
from rig.errors import UNEXPECTED, RigError
from rig.events import Event, InterlockReset, InterlockTripped, Observer, RestSeen
from rig.tester.monitor import LOOK_INTERVAL, MISSES
from rig.tester.rest_judge import motion_shown, shows_rest
from rig.tester.status import TesterStatus

PollResult = TesterStatus | RigError
log = logging.getLogger(__name__)


class IdleMonitor:
    """Polls from a thread of its own until it is closed. Any thread may suspend it.

    Args:
        poll: reads the tester's status once, in a short and limited time; raises RigError where the tester does not
            answer. None: there is no tester.
        state: gives the known state of the rig.
        observer: gets an event for each difference between a poll and the known state.
        interval: between polls, s.
    """

    def __init__(
        self,
        poll: Callable[[], TesterStatus] | None,
        state: Callable[[], RigState],
        observer: Observer,
        interval: float = LOOK_INTERVAL,
    ) -> None:
        self._poll = poll
        self._state = state
        self._observer = observer
        self._interval = interval
        self._changed = threading.Condition()
        self._drivers = 0
        self._polling = False
        self._closed = False
        self._before: TesterStatus | None = None  # the last status since the tester was driven
        self._thread: threading.Thread | None = None
        if poll is not None:
            self._thread = threading.Thread(target=self._run, args=(poll,), name="idle monitor", daemon=True)
            self._thread.start()

    @contextmanager
    def suspended(self) -> Iterator[None]:
        """Leave the tester to the caller while the context lasts; waits for a poll that is under way."""
        with self._changed:
            self._drivers += 1
            self._changed.wait_for(lambda: not self._polling)
            self._before = None
        try:
            yield
        finally:
            with self._changed:
                self._drivers -= 1

    @contextmanager
    def resumed(self) -> Iterator[None]:
        """Poll again while the context lasts, inside a context of `suspended`, because the run only waits."""
        with self._changed:
            self._drivers -= 1
        try:
            yield
        finally:
            with self._changed:
                self._drivers += 1
                self._changed.wait_for(lambda: not self._polling)
                self._before = None

    def look(self) -> None:
        """Poll once, inside a context of `suspended`, because the last poll may be out of date."""
        if self._poll is not None:
            for event in events_of(self._state(), _result_of(self._poll)):
                self._observer(event)

    def close(self) -> None:
        """End polling."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        if self._thread is not None:
            self._thread.join()

    def _run(self, poll: Callable[[], TesterStatus]) -> None:
        misses = 0
        while not self._closed:
            with self._poll_allowed() as allowed:
                if allowed:
                    result = _result_of(poll)
                    misses = misses + 1 if isinstance(result, RigError) else 0
                    self._report(result, misses)
            with self._changed:
                self._changed.wait_for(lambda: self._closed, self._interval)

    @contextmanager
    def _poll_allowed(self) -> Iterator[bool]:
        """Whether nothing drives; `suspended` then waits until the context is left, however it is left."""
        with self._changed:
            self._polling = not self._drivers
        try:
            yield self._polling
        finally:
            with self._changed:
                self._polling = False
                self._changed.notify_all()

    def _report(self, result: PollResult, misses: int) -> None:
        with self._changed:
            if not self._drivers and (misses == 0 or misses >= MISSES):
                for event in events_of(self._state(), result, self._before):
                    self._observer(event)
                self._before = None if isinstance(result, RigError) else result


def _result_of(poll: Callable[[], TesterStatus]) -> PollResult:
    try:
        return poll()
    except RigError as error:
        return error
    except Exception:  # whatever it is: nothing would look at the tester any more
        log.exception("polling the tester ended with an unexpected error")
        return RigError(UNEXPECTED)


def events_of(state: RigState, result: PollResult, before: TesterStatus | None = None) -> tuple[Event, ...]:
    """The differences between a poll of the tester and the known `state`; empty where there is none.

    Args:
        before: the status of the poll before, where nothing has driven the tester since; None: there is none.
    """
    if isinstance(result, RigError):
        return (TesterSilent(str(result)),) if state.tester_silent in (None, NOT_READ) else ()
    answers = (TesterAnswers(),) if state.tester_silent else ()
    rest = _events_of_rest(state, result, before)
    if result.stopped_by & ~state.interlocks or (result.is_stopped and not state.is_tripped):
        return *answers, InterlockTripped(result.stopped_by, stopped=True), *rest
    if state.is_tripped and not result.is_stopped:
        return *answers, InterlockReset(state.interlocks), *rest  # by another client, or at the instrument
    return *answers, *rest


def _events_of_rest(state: RigState, status: TesterStatus, before: TesterStatus | None) -> tuple[Event, ...]:
    if state.rest_unknown is None:
        motion = motion_shown(status, before)
        return () if motion is None else (UnaskedMotion(f"{motion}, although no run is in progress"),)
    return (RestSeen(),) if shows_rest(status, before) else ()
