"""Messages to systemd: that this process is ready, and that it still works (sd_notify(3))."""

import logging
import os
import socket
import time

INTERVAL = 1.0
"""Seconds between two signs of life; `WatchdogSec` of a unit is ten of them or more."""
log = logging.getLogger(__name__)


class SignsOfLife:
    """Tells the systemd that has started this process; processes that this one starts tell it nothing.

    Whatever has to go on for the process to be of use calls `give`. Where no systemd listens, nothing is told.
    """

    def __init__(self) -> None:
        address = os.environ.pop("NOTIFY_SOCKET", None)
        self._address = None if address is None else address.replace("@", "\0", 1)  # of the abstract namespace
        self._next = 0.0

    def give(self) -> None:
        """Say that this process is ready and works, once in `INTERVAL`; never waits."""
        if self._address is None or (now := time.monotonic()) < self._next:
            return
        self._next = now + INTERVAL
        try:
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as line:
                line.setblocking(False)
                line.sendto(b"READY=1\nWATCHDOG=1", self._address)
        except OSError as error:  # it is restarted itself, or busy; the next sign is soon
            log.warning("systemd cannot be told that this process works: %s", error)
