"""Another process that runs until the test ends it."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def another_process(script: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a script that prints "held" once it holds what it is to hold, and then waits."""
    command = [sys.executable, "-c", script]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"held\n"
        yield holder
