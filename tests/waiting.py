"""Waiting for what other threads and processes do."""

import time
from collections.abc import Callable

SHORTEST = 0.002  # s
LONG = 300.0  # s: longer than anything takes, on a slow and busy machine too


def until(holds: Callable[[], bool], longest: float = 0.02) -> None:
    """Wait until something holds; fails where it does not within `LONG` s.

    A look that is work, such as a request, takes the processor from what it waits for. So the pause between two looks
    grows with the time that was waited, up to `longest` s.
    """
    began = time.monotonic()
    while not holds():
        waited = time.monotonic() - began
        assert waited < LONG, "waited in vain"
        time.sleep(min(SHORTEST + waited / 20, longest))
