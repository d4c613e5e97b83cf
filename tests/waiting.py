"""Waiting for what other threads and processes do."""

import time
from collections.abc import Callable

LONG = 300.0  # s: longer than anything takes, on a slow and busy machine too


def until(holds: Callable[[], bool], pause: float = 0.002) -> None:
    """Wait until something holds, with a pause in s between two looks; fails where it does not within `LONG` s.

    A look that is work, such as a request, wants a longer pause where what is waited for takes seconds: without one, it
    takes the processor from what it waits for.
    """
    end = time.monotonic() + LONG
    while not holds():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(pause)
