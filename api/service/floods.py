"""Limits of the requests of each caller: a number at once, and a rate from then on."""

import time
from collections import OrderedDict
from collections.abc import Callable

MOST_CALLERS = 1000
"""Callers that are remembered; the one who has asked for nothing for longest is forgotten first."""


class TokenBuckets:
    """A token bucket for each caller, which begins full; used by one thread.

    Args:
        at_once: tokens of a full bucket.
        a_second: tokens that come back.
        clock: monotonic, in s.
    """

    def __init__(self, at_once: float, a_second: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._at_once = at_once
        self._a_second = a_second
        self._clock = clock
        self._buckets = OrderedDict[str, tuple[float, float]]()  # tokens, and when they were counted

    @property
    def callers(self) -> int:
        """Callers that are remembered."""
        return len(self._buckets)

    def take(self, caller: str) -> bool:
        """Take a token of a caller; False where there is none."""
        now = self._clock()
        tokens, counted = self._buckets.pop(caller, (self._at_once, now))
        tokens = min(self._at_once, tokens + self._a_second * (now - counted))
        has_one = tokens >= 1
        self._buckets[caller] = (tokens - has_one, now)
        if len(self._buckets) > MOST_CALLERS:
            self._buckets.popitem(last=False)
        return has_one
