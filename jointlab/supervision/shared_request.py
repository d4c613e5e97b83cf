"""A request that many callers make at once: a few are under way at a time, and callers that wait share the next one."""

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Generic, TypeVar

_Result = TypeVar("_Result")


class SharedRequest(Generic[_Result]):
    """Any thread may call it. Each caller gets the outcome of a request that began after its call.

    Args:
        do: makes the request, given who asks.
        places: requests that may be under way at a time.
    """

    def __init__(self, do: Callable[[str], _Result], places: int) -> None:
        self._do = do
        self._places = threading.Semaphore(places)
        self._lock = threading.Lock()
        self._next: Future[_Result] | None = None  # that has not begun; who comes now may share it

    def __call__(self, who: str) -> _Result:
        """The outcome, which may be an error; the first of those who share it is told as the one who asks."""
        with self._lock:
            shared, begins = self._next, self._next is None
            if shared is None:
                shared = self._next = Future()
        if begins:
            with self._places:
                with self._lock:
                    self._next = None
                try:
                    shared.set_result(self._do(who))
                except Exception as error:  # noqa: BLE001 - each of those who share it raises it
                    shared.set_exception(error)
        return shared.result()
