"""The time of day for as long as the service runs: it never goes back, however the computer's clock is set.

What has ended once stays ended. Where the clock was ahead and is corrected, the time that was shown goes on from where
it was; a service that is started anew takes the computer's clock as it is.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta


def _wall() -> datetime:
    return datetime.now(UTC)


class MonotonicClock:
    """Called, it is the time now, UTC. Any thread may call it."""

    def __init__(self, wall: Callable[[], datetime] = _wall, monotonic: Callable[[], float] = time.monotonic) -> None:
        self._wall = wall
        self._monotonic = monotonic
        self._lock = threading.Lock()
        self._shown, self._at = wall(), monotonic()

    def __call__(self) -> datetime:
        """The computer's clock, or where that was set back, the latest time it has shown and what passed since."""
        with self._lock:
            at = self._monotonic()
            self._shown = max(self._wall(), self._shown + timedelta(seconds=at - self._at))
            self._at = at
            return self._shown
