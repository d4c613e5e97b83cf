"""The time of day for as long as the service runs: it never goes back, however the computer's clock is set.

A key that has ended stays ended. Where the computer's clock was ahead and is corrected, this clock goes on from its
latest time. After a restart of the service it begins with the computer's clock.
"""

import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta


def _wall() -> datetime:
    return datetime.now(UTC)


class MonotonicClock:
    """Calling it gives the present time, UTC. Any thread may call it."""

    def __init__(self, wall: Callable[[], datetime] = _wall, monotonic: Callable[[], float] = time.monotonic) -> None:
        self._wall = wall
        self._monotonic = monotonic
        self._lock = threading.Lock()
        self._shown, self._at = wall(), monotonic()

    def __call__(self) -> datetime:
        """The computer's time, or where that clock was set back, its latest time and the seconds since."""
        with self._lock:
            at = self._monotonic()
            self._shown = max(self._wall(), self._shown + timedelta(seconds=at - self._at))
            self._at = at
            return self._shown
