"""The room's thermometer on a serial line: the command ``T?`` is answered by ``+23.14 C``."""

from __future__ import annotations

import re
import threading

import serial

from rig.errors import RigError
from rig.serial_line import LINE_ERRORS, OPENING_ERRORS

BAUD_RATE = 9600
ATTEMPTS = 2
LOWEST, HIGHEST = 5.0, 45.0  # degrees Celsius, of a plausible reading
LONGEST_REPLY = 64  # bytes


class ThermometerError(RigError):
    """The thermometer cannot be opened, does not answer, or its answer is implausible."""


class Thermometer:
    """One thermometer, at any URL that pyserial opens: ``/dev/ttyUSB0``, ``COM3``, ``socket://host:port``, ...

    A context manager: leaving it closes the line. A serial port is opened for this program alone, because two programs
    that read from it would take each other's answers. Any thread may call it.

    Args:
        url: of the line.
        timeout: s that one reply may take.

    Raises:
        ThermometerError: there is nothing to open at `url`.
    """

    def __init__(self, url: str, timeout: float = 0.5) -> None:
        self.url = url
        self._lock = threading.Lock()
        try:
            self._port = serial.serial_for_url(
                url, baudrate=BAUD_RATE, timeout=timeout, write_timeout=timeout, exclusive=True
            )
        except OPENING_ERRORS as error:
            raise ThermometerError(f"thermometer at {url}: cannot open the line ({error})") from error

    def celsius(self) -> float:
        """Temperature now, in degrees Celsius.

        Raises:
            ThermometerError: no answer in time, twice; or an answer that is no temperature, or an implausible one.
        """
        with self._lock:
            for _ in range(ATTEMPTS):
                reply = self._ask()
                if reply:
                    return self._plausible(reply)
        raise ThermometerError(f"thermometer at {self.url}: no answer; check its cable and power")

    def close(self) -> None:
        """Close the line."""
        self._port.close()

    def __enter__(self) -> Thermometer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _ask(self) -> str:
        """The answer without its line end; empty where no complete one came in time."""
        try:
            self._port.reset_input_buffer()  # the rest of a late answer to an earlier request
            self._port.write(b"T?\n")
            reply = bytes(self._port.read_until(b"\n", LONGEST_REPLY))
        except LINE_ERRORS as error:
            raise ThermometerError(f"thermometer at {self.url}: the line is lost ({error})") from error
        return reply.decode("ascii", errors="replace").strip() if reply.endswith(b"\n") else ""

    def _plausible(self, reply: str) -> float:
        match = re.fullmatch(r"([+-]\d+\.\d+) C", reply)
        if match is None:
            raise ThermometerError(f"thermometer at {self.url}: answered {reply!r}, which is no temperature")
        celsius = float(match[1])
        if not LOWEST <= celsius <= HIGHEST:
            raise ThermometerError(
                f"thermometer at {self.url}: {celsius:g} C is outside {LOWEST:g} to {HIGHEST:g} C; is its sensor open?"
            )
        return celsius
