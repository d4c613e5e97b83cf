"""A STOP button on a serial port: a byte means STOP, and so does a lost line."""

import logging
import socket
from collections.abc import Callable

import serial

from jointlab.background import BackgroundThread

RETRY = 1.0  # s between two attempts to open a lost line
READ_TIMEOUT = 0.2  # s
BOUNCES = 1000  # bytes, more than a button sends in that time
KEEPALIVE = {"TCP_KEEPIDLE": 1, "TCP_KEEPALIVE": 1, "TCP_KEEPINTVL": 1, "TCP_KEEPCNT": 3, "TCP_USER_TIMEOUT": 3000}
"""Options by which the operating system finds that a network line is dead, as far as it has them: it asks each second,
and gives up after three seconds (the last one is in ms). Without them a line on which nothing is sent is never lost."""
log = logging.getLogger(__name__)


class StopButton(BackgroundThread):
    """Watches the button at `url` until it is closed.

    While the line is lost, or its URL makes no sense, every attempt to open it presses STOP once more, so that no reset
    holds before it is back.

    Args:
        url: serial port or pyserial URL.
        press: latches a STOP, given who asks, why, and whether that is a person.
    """

    def __init__(self, url: str, press: Callable[[str, str, bool], object]) -> None:
        self._url = url
        self._press = press
        super().__init__("STOP button")

    def _run(self) -> None:
        while not self._closed.is_set():
            try:
                self._watch()
            except Exception as error:  # noqa: BLE001 - any error leaves the button unwatched: STOP
                log.warning("STOP button at %s: %s", self._url, error)
                self._press(f"button at {self._url}", "its line is lost", False)
                self._closed.wait(RETRY)

    def _watch(self) -> None:
        """Press STOP for each press of the button until this is closed; raises whatever leaves it unwatched."""
        with serial.serial_for_url(self._url, timeout=READ_TIMEOUT) as line:
            _keep_alive(line)
            while not self._closed.is_set():
                if line.read(1):
                    self._press(f"button at {self._url}", "the button was pressed", True)
                    line.read(BOUNCES)  # of one press


def _keep_alive(line: serial.SerialBase) -> None:
    """Have the operating system watch the connection of `line`, where that is one of a network."""
    connection = getattr(line, "_socket", None)  # socket:// and rfc2217://; pyserial has no public way to it
    if isinstance(connection, socket.socket):
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for name, value in KEEPALIVE.items():
            if hasattr(socket, name):
                connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
