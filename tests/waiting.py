"""Waiting for what other threads and processes do."""

import time
from collections.abc import Callable

LONG = 300.0  # s: longer than anything takes, on a slow and busy machine too


def until(holds: Callable[[], bool]) -> None:
    """Wait until something holds; fails where it does not within `LONG` s."""
    end = time.monotonic() + LONG
    while not holds():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.002)
