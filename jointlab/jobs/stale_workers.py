"""Stale workers: those without a new sign of life.

The time without a sign is measured here, by a monotonic clock. A time of the worker's own clock is only compared with
the one before: that clock may be wrong, and be set between two heartbeats.
"""

import time
from collections.abc import Callable, Iterable

from store.jobs import LEASE, SignOfLife


class StaleWorkers:
    """Remembers when each sign of life was first seen; used by one thread."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._seen = dict[SignOfLife, float]()

    def lasting(self, signs: Iterable[SignOfLife]) -> list[SignOfLife]:
        """Those of the latest `signs` that have been the latest for longer than a lease."""
        now = self._clock()
        self._seen = {sign: self._seen.get(sign, now) for sign in signs}
        return [sign for sign, since in self._seen.items() if now - since > LEASE.total_seconds()]
