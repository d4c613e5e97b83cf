"""The process beside the drive process that tells people of alarms while no program steers the rig."""

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path


class Teller:
    """Starts it and lets it know; nothing here waits for it. It goes on after this one, until all is told.

    It is started once, before the rig moves and before this process takes its priority: a process with threads that
    starts another one stands still for a moment.

    Attributes:
        process: that tells.
    """

    def __init__(self, folder: Path, rig: str) -> None:
        command = [sys.executable, "-m", "jointlab.alarms.alone", str(folder), rig]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, bufsize=0, start_new_session=True)
        assert self.process.stdin is not None
        self._pipe = self.process.stdin
        os.set_blocking(self._pipe.fileno(), False)
        self._said: bool | None = None

    def let_tell(self, is_alone: bool) -> None:
        """Let it tell or not, as soon as it reads; where it has ended, nothing happens."""
        with suppress(BrokenPipeError):
            if is_alone is not self._said and self._pipe.write(b"1" if is_alone else b"0"):
                self._said = is_alone
