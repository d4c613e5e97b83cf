"""The relay: a lamp or horn on a serial port that is on while an alarm is active."""

import logging
from collections.abc import Callable

import serial

from jointlab.alarms.settings import RelaySettings
from jointlab.background import BackgroundThread
from rig.serial_line import OPENING_ERRORS

RETRY = 5.0  # s between two attempts to open the port
REPEAT = 5.0  # s after which the state is set again, for a relay that has lost it
LOOK = 0.2  # s between two looks for alarms
WRITE_TIMEOUT = 2.0  # s
log = logging.getLogger(__name__)


class Relay(BackgroundThread):
    """Switches the relay from a thread of its own, until it is closed; the relay then stays as it is.

    Args:
        is_on: whether an alarm is active; must not block.
    """

    def __init__(self, settings: RelaySettings, is_on: Callable[[], bool]) -> None:
        self._settings = settings
        self._is_on = is_on
        super().__init__("relay")

    def _run(self) -> None:
        while not self._closed.is_set():
            try:
                line = serial.serial_for_url(self._settings.url, do_not_open=True, write_timeout=WRITE_TIMEOUT)
                self._set_line(line, self._is_on())  # first: opening sets the outputs
                line.open()
                with line:
                    self._keep(line)
            except OPENING_ERRORS as error:
                log.warning("the relay at %s cannot be switched: %s", self._settings.url, error)
                self._closed.wait(RETRY)

    def _keep(self, line: serial.SerialBase) -> None:
        while not self._closed.is_set():
            is_on = self._is_on()
            self._set_line(line, is_on)
            if sent := bytes.fromhex(self._settings.on if is_on else self._settings.off):
                line.write(sent)
            waited = 0.0
            while waited < REPEAT and self._is_on() is is_on and not self._closed.wait(LOOK):
                waited += LOOK

    def _set_line(self, line: serial.SerialBase, is_on: bool) -> None:
        match self._settings.line:
            case "rts":
                line.rts = is_on
            case "dtr":
                line.dtr = is_on
            case None:
                pass
