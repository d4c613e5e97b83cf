"""Workers that are not heard of any more.

How long a worker has been silent is measured here, by a clock that nobody can set. What the worker's own clock says is
only compared with what it said before: it may be wrong, and be set forwards or back between two heartbeats.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable

from store.jobs import LEASE, SignOfLife


class StaleWorkers:
    """When each sign of life was first seen; one thread asks it, now and then."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._seen = dict[SignOfLife, float]()

    def lasting(self, signs: Iterable[SignOfLife]) -> list[SignOfLife]:
        """Those of the latest `signs` that have been the latest for longer than a lease."""
        now = self._clock()
        self._seen = {sign: self._seen.get(sign, now) for sign in signs}
        return [sign for sign, since in self._seen.items() if now - since > LEASE.total_seconds()]
