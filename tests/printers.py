"""Browsers that never print, in place of Chromium."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SCRIPT = "#!/bin/sh\nsleep 1000 &\necho $$ $! > {started}.new\nmv {started}.new {started}\nwait\n"
"""As the launcher of a distribution that starts Chromium as a process of its own."""


def put_endless_printer(folder: Path) -> tuple[Callable[[], list[int]], dict[str, str]]:
    """Put a `chromium` that never ends into a folder.

    Returns: its processes, empty before it begins; and an environment whose path and temporary folder lead there.
    """
    programs, temporary, started = folder / "programs", folder / "temporary", folder / "started"
    programs.mkdir()
    temporary.mkdir()
    program = programs / "chromium"
    program.write_text(SCRIPT.format(started=started))
    program.chmod(0o755)
    path = os.pathsep.join((str(programs), os.environ["PATH"]))
    environment = {**os.environ, "PATH": path, "TMPDIR": str(temporary), "PYTHONPATH": str(ROOT)}
    return lambda: [int(each) for each in started.read_text().split()] if started.exists() else [], environment


@contextmanager
def others_browser() -> Iterator[Callable[[], bool]]:
    """A process that a test started beside the browser: whether it still runs."""
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as process:
        yield lambda: process.poll() is None
        process.kill()


def is_alive(process: int) -> bool:
    """Whether a process runs; one that has ended and that nobody has asked about does not."""
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state != "Z"
