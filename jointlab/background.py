"""A thread of its own for work that goes on until it is closed, and for which nothing else waits."""

import threading
from abc import ABC, abstractmethod


class BackgroundThread(ABC):
    """Works in a thread until it is closed; starts at the end of `__init__`, so a subclass calls that last."""

    def __init__(self, name: str) -> None:
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread after what is under way."""
        self._closed.set()
        self._thread.join()

    @abstractmethod
    def _run(self) -> None:
        """Work until `_closed` is set."""
