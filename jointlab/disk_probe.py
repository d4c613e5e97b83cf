"""Whether the disks that are written to answer and have space: known at any moment, without waiting for a disk."""

import shutil
import threading
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Self

from rig.runs.spool import FREE_TO_BEGIN

PERIOD = 2.0  # s between two looks
LATE = 5.0  # s without an answer, after which a disk counts as one that hangs


class DiskProbe:
    """Looks at the disks of `folders` every `period` s in a thread of its own; it reads only.

    Args:
        folders: one that does not exist yet counts as the next one above it.
        least: bytes that have to be free on each disk.
    """

    def __init__(self, folders: Iterable[Path], least: int = FREE_TO_BEGIN, period: float = PERIOD) -> None:
        self._folders = tuple(folders)
        self._least = least
        self._period = period
        self._trouble: str | None = None
        self._asked: tuple[float, Path] | None = None  # monotonic clock, of the look that has no answer yet
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._work, name="disk probe", daemon=True)
        self._thread.start()

    @property
    def trouble(self) -> str | None:
        """What is wrong with a disk, in words; None where nothing is. Never waits."""
        asked = self._asked
        if asked is not None and time.monotonic() - asked[0] > LATE:
            return f"the disk of {asked[1]} does not answer"
        return self._trouble

    def close(self) -> None:
        """Stop looking; does not wait for a disk that hangs."""
        self._ended.set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def _work(self) -> None:
        while not self._ended.is_set():
            found = [trouble for folder in self._folders if (trouble := self._look(folder)) is not None]
            self._trouble = "; ".join(dict.fromkeys(found)) or None
            self._ended.wait(self._period)

    def _look(self, folder: Path) -> str | None:
        self._asked = time.monotonic(), folder
        try:
            there = next(each for each in (folder, *folder.absolute().parents) if each.exists())
            free = shutil.disk_usage(there).free
        except OSError as error:
            return f"the disk of {folder} cannot be read: {error.strerror or error}"
        finally:
            self._asked = None
        if free >= self._least:
            return None
        return f"the disk of {folder} is full: {free / 1e6:.0f} MB are free, {self._least / 1e6:.0f} MB are needed"
