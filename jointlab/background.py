"""Threads of their own for work that nothing else waits for: until it is closed, or until the program ends."""

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import Future


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


def in_background(work: Callable[[], object]) -> Future[None]:
    """Do work in a thread that ends with the program; the future has the error that ended it."""
    ended = Future[None]()

    def do() -> None:
        try:
            work()
        except BaseException as error:  # noqa: BLE001 - the future raises it to its reader
            ended.set_exception(error)
        else:
            ended.set_result(None)

    threading.Thread(target=do, name=__name__, daemon=True).start()
    return ended
