"""The drive process of a folder, as the file beside its lock names it."""

import os
import re
import signal
from pathlib import Path

from jointlab.drive.process import HOLDER, LOCK
from store.database.file_lock import LockHeldError, exclusive_lock
from tests.waiting import until


def drive_process(folder: Path) -> int:
    """Number of the process that drives the rig of `folder`."""
    found = re.search(r"process (\d+)", (folder / "drive" / HOLDER).read_text(encoding="utf-8"))
    assert found is not None
    return int(found[1])


def end_drive_process(folder: Path) -> None:
    """End it in order; one that a service has found, and not started, outlives that service."""
    if not _has_ended(folder):
        os.kill(drive_process(folder), signal.SIGTERM)
        until(lambda: _has_ended(folder))


def _has_ended(folder: Path) -> bool:
    try:
        with exclusive_lock(folder / "drive" / LOCK):
            return True
    except LockHeldError:
        return False
