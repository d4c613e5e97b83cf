"""Taking turns at one line: whoever has waited longest goes next.

A lock of the operating system goes to whoever is quickest, and that is the thread which has just given it back: one
that polls keeps a heartbeat or a stop waiting for as long as it polls.
"""

from __future__ import annotations

import math
import threading
from collections import deque


class FairLock:
    """A lock that threads get in the order in which they asked. A thread that has it must not ask again."""

    def __init__(self) -> None:
        self._changing = threading.Lock()
        self._taken = False
        self._waiting = deque[threading.Event]()

    def take(self, patience: float = math.inf) -> bool:
        """Wait for a turn; False where it did not come within `patience` s."""
        with self._changing:
            if not self._taken:
                self._taken = True
                return True
            mine = threading.Event()
            self._waiting.append(mine)
        try:
            came = mine.wait(None if patience == math.inf else max(patience, 0.0))
        except BaseException:  # Ctrl-C; nobody is to wait for a turn that is not used
            if not self._leave(mine):
                self.give_back()
            raise
        return came or not self._leave(mine)

    def _leave(self, mine: threading.Event) -> bool:
        """Wait no more; False where the turn came at the last moment."""
        with self._changing:
            if mine.is_set():
                return False
            self._waiting.remove(mine)
            return True

    def give_back(self) -> None:
        """End a turn; the next one's begins."""
        with self._changing:
            if self._waiting:
                self._waiting.popleft().set()
            else:
                self._taken = False

    def __enter__(self) -> None:
        self.take()

    def __exit__(self, *_: object) -> None:
        self.give_back()
