"""A fair lock: threads get it in the order in which they asked for it; an urgent one comes first.

A lock of the operating system goes to the quickest thread, and that is often the one that has just released it: a
thread that polls would keep a heartbeat or a stop waiting for as long as it polls.
"""

import math
import threading
from collections import deque


class FairLock:
    """A lock that threads get in the order in which they asked, urgent ones before the others.

    A thread that holds it must not ask again.
    """

    def __init__(self) -> None:
        self._changing = threading.Lock()
        self._held = False
        self._urgent, self._waiting = deque[threading.Event](), deque[threading.Event]()

    @property
    def is_urgent(self) -> bool:
        """Whether an urgent thread waits: the one that holds the lock should hurry."""
        return bool(self._urgent)

    def acquire(self, timeout: float = math.inf, *, urgent: bool = False) -> bool:
        """Wait for the lock; False where it did not become free within `timeout` s."""
        queue = self._urgent if urgent else self._waiting
        with self._changing:
            if not self._held:
                self._held = True
                return True
            turn = threading.Event()
            queue.append(turn)
        try:
            came = turn.wait(None if timeout == math.inf else max(timeout, 0.0))
        except BaseException:  # Ctrl-C; no thread may wait for a turn that is not used
            if not self._leave(queue, turn):
                self.release()
            raise
        return came or not self._leave(queue, turn)

    def _leave(self, queue: deque[threading.Event], turn: threading.Event) -> bool:
        """Stop waiting; False where the turn came at the last moment."""
        with self._changing:
            if turn.is_set():
                return False
            queue.remove(turn)
            return True

    def release(self) -> None:
        """Pass the lock to the urgent thread that has waited longest; if none is urgent, to the longest waiting one."""
        with self._changing:
            if queue := self._urgent or self._waiting:
                queue.popleft().set()
            else:
                self._held = False

    def __enter__(self) -> None:
        self.acquire()

    def __exit__(self, *_: object) -> None:
        self.release()
