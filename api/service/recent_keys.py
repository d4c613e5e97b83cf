"""Keys that were looked up a moment ago, so that a client that reads often does not cost a lookup each time.

For reads alone: a request that acts looks its key up. So a key that another program revoked acts no more from then on,
and reads for `READS_FOR` at most. One that this service revoked reads no more, either.
"""

import threading
import time
from collections.abc import Callable

from store.service.keys import ApiKey, digest_of

READS_FOR = 2.0
"""Seconds for which a key that was looked up is known to reads."""
MOST = 256
"""Keys that are kept at a time. One more removes all, so that each is looked up again."""


class RecentKeys:
    """Keys by the hash of their secret. Any thread may call it."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._found = dict[str, tuple[float, ApiKey]]()

    def add(self, secret: str, key: ApiKey) -> None:
        """Keep what was just looked up."""
        with self._lock:
            if len(self._found) >= MOST:
                self._found.clear()
            self._found[digest_of(secret)] = self._clock(), key

    def get(self, secret: str) -> ApiKey | None:
        """The key of a secret, valid or not; None where it was not looked up in the last `READS_FOR`."""
        digest = digest_of(secret)
        with self._lock:
            since, key = self._found.get(digest, (0.0, None))
            if key is not None and self._clock() - since > READS_FOR:
                del self._found[digest]
                return None
            return key

    def clear(self) -> None:
        """Remove all keys, because one was revoked: each is looked up again."""
        with self._lock:
            self._found.clear()
