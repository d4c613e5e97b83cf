"""The heartbeat of the tester, which stays away when the program has ended, so that the watchdog acts."""

import logging
import threading

from rig.errors import RigError
from rig.tester.wire import TesterWire

BEATS = 10  # in one watchdog time; with each of them an old status shows its age

log = logging.getLogger(__name__)


class Heartbeat:
    """Keeps the watchdog from acting until `stop`, or until the thread that made it has ended.

    Without a watchdog (its time is None) it does nothing.
    """

    def __init__(self, wire: TesterWire, watchdog_time: float | None) -> None:
        self._wire = wire
        self._pause = (watchdog_time or 0.0) / BEATS
        self._stopped = threading.Event()
        self._owner = threading.current_thread()
        self._thread = threading.Thread(target=self._beat, name="tester heartbeat", daemon=True)
        if watchdog_time is not None:
            self._thread.start()

    def stop(self) -> None:
        """Stop beating; from now on the watchdog acts."""
        self._stopped.set()

    def join(self) -> None:
        """Stop, and return when the last beat is over."""
        self.stop()
        if self._thread.ident is not None:
            self._thread.join()

    def _beat(self) -> None:
        count = 0
        while self._owner.is_alive() and not self._stopped.is_set():
            count = count % 0xFFFF + 1
            try:
                self._wire.beat(count)
            except RigError as error:
                # nothing else to do here: the watchdog acts when beats stay away, and every command shows the error
                log.info("a heartbeat did not arrive: %s", error)
            self._stopped.wait(self._pause)
