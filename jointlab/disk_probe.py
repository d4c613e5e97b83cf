"""Whether the disks that are written to answer and have space: known at any moment, without waiting for a disk."""

import shutil
import time
from collections.abc import Iterable
from pathlib import Path

from rig.runs.spool import FREE_TO_BEGIN
from store.probe import PERIOD, Probe

LATE = 5.0  # s without an answer, after which a disk counts as one that hangs


class DiskProbe(Probe):
    """Looks at the disks of `folders`; it reads only.

    Args:
        folders: one that does not exist yet counts as the next one above it.
        least: bytes that have to be free on each disk.
    """

    def __init__(self, folders: Iterable[Path], least: int = FREE_TO_BEGIN, period: float = PERIOD) -> None:
        self._folders = tuple(folders)
        self._least = least
        self._trouble: str | None = None
        self._asked: tuple[float, Path] | None = None  # monotonic clock, of the look that has no answer yet
        super().__init__("disk probe", period)

    @property
    def trouble(self) -> str | None:
        """What is wrong with a disk, in words; None where nothing is. Never waits."""
        asked = self._asked
        if asked is not None and time.monotonic() - asked[0] > LATE:
            return f"the disk of {asked[1]} does not answer"
        return self._trouble

    def _look(self) -> None:
        found = [trouble for folder in self._folders if (trouble := self._trouble_of(folder)) is not None]
        self._trouble = "; ".join(dict.fromkeys(found)) or None

    def _trouble_of(self, folder: Path) -> str | None:
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
