"""The heartbeat that keeps the tester's watchdog quiet for as long as somebody is responsible for the actuator."""

from __future__ import annotations

import logging
import threading

from rig.errors import RigError
from rig.tester_wire import TesterWire

BEATS = 5  # in one watchdog time

log = logging.getLogger(__name__)


class Heartbeat:
    """Beats until it is stopped, or the thread that made it has ended: a beat without an owner guards nothing."""

    def __init__(self, wire: TesterWire, watchdog_time: float) -> None:
        self._wire = wire
        self._pause = watchdog_time / BEATS
        self._stopped = threading.Event()
        self._owner = threading.current_thread()
        self._thread = threading.Thread(target=self._beat, name="tester heartbeat", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Beat no more; from now on the watchdog acts."""
        self._stopped.set()

    def join(self) -> None:
        """Stop, and return when the last beat is over."""
        self.stop()
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
