"""What an observer is told of a tester: interlocks that fire and are reset, and whether its actuator rests."""

import logging
import threading

from rig.events import InterlockReset, InterlockTripped, Observer, RestSeen, RestUnknown, TesterLineLost
from rig.registers import NO_INTERLOCK, Interlock
from rig.tester.status import TesterStatus, stopping_text

log = logging.getLogger(__name__)


class TesterReports:
    """Tells `observer` each change once. Any thread may call it.

    Args:
        observer: gets the events.
        name: of the tester, for the log.
    """

    def __init__(self, observer: Observer, name: str) -> None:
        self._observer = observer
        self._name = name
        self._lock = threading.Lock()
        self._interlocks, self._stopped = NO_INTERLOCK, False  # as they were reported last
        self._rests: bool | None = None  # whether it was reported last that the actuator rests

    def seen(self, status: TesterStatus) -> None:
        """Log and report interlocks that fired since the last status, or a trip without one."""
        with self._lock:
            new, self._interlocks = status.interlocks & ~self._interlocks, status.interlocks
            has_stopped, self._stopped = status.is_stopped and not self._stopped, status.is_stopped
        if has_stopped:
            new |= status.stopped_by
        if new or has_stopped:
            log.warning("interlocks of %s: %s", self._name, stopping_text(new))
            self._observer(InterlockTripped(new, stopped=has_stopped or bool(new & status.stopped_by)))

    def seen_at_rest(self, status: TesterStatus) -> None:
        """As `seen`; reports that the actuator rests where that is not known already."""
        self.seen(status)
        if not self._rests:
            self._rests = True
            self._observer(RestSeen())

    def rest_unknown(self, why: str) -> None:
        """Report that rest was not confirmed, where that was not the last report."""
        if self._rests is not False:
            self._rests = False
            self._observer(RestUnknown(why))

    def line_lost(self, why: Exception, watchdog_time: float | None) -> None:
        """Log and report that the tester, whose watchdog acts after `watchdog_time` s, does not answer any more."""
        self._rests = None
        log.warning("%s", why)
        self._observer(TesterLineLost(watchdog_time))

    def reset(self, before: Interlock) -> None:
        """Log and report that the interlocks `before` were reset."""
        with self._lock:
            self._interlocks, self._stopped = NO_INTERLOCK, False
        log.warning("interlocks of %s reset: %s", self._name, stopping_text(before))
        self._observer(InterlockReset(before))
