"""Keys that a person presses at the terminal."""

import os
import signal


def press(key: signal.Signals, times: int = 1) -> None:
    """Send what the terminal sends for a key to this process, `times` times."""
    for _ in range(times):
        os.kill(os.getpid(), key)
