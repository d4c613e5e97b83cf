"""A STOP outlives its process: a file in the folder of the rig says that one is in force."""

import logging
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from jointlab.background import BackgroundThread
from rig.tester.stop_latch import Stop, StopLatch
from store.new_file import synchronise

INTERVAL = 0.05  # s between two looks at the latch
UNREADABLE = Stop(0, "an earlier process", "STOP was not reset, and the file that says why cannot be read", True)
_stops = TypeAdapter(Stop)
log = logging.getLogger(__name__)


class KeptStop(BackgroundThread):
    """Sets the latch of a new process if a STOP of an earlier one was not reset, and keeps `file` equal to the latch.

    A thread of its own writes, so that STOP waits for no disk; what cannot be written is logged. At the end it writes
    what is in force then.
    """

    def __init__(self, file: Path, latch: StopLatch) -> None:
        self._file, self._latch = file, latch
        if file.exists():
            latch.restore(_read(file))
        self._kept = latch.in_force
        super().__init__("kept STOP")

    def _run(self) -> None:
        is_last = has_failed = False
        while not is_last:
            is_last = self._closed.wait(INTERVAL)
            stop = self._latch.in_force
            if stop != self._kept:
                try:
                    self._keep(stop)
                    self._kept, has_failed = stop, False
                except OSError as error:  # tried again each time, and said once
                    if not has_failed:
                        log.warning("a restart would not know of STOP: %s", error)
                    has_failed = True

    def _keep(self, stop: Stop | None) -> None:
        if stop is None:
            self._file.unlink(missing_ok=True)
        else:
            self._file.write_bytes(_stops.dump_json(stop))
            synchronise(self._file)
            synchronise(self._file.parent)  # which has the name of a new file


def _read(file: Path) -> Stop:
    try:
        return _stops.validate_json(file.read_bytes())
    except (OSError, ValidationError):
        return UNREADABLE
