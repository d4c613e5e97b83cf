"""The simulated thermometer, on a TCP port (for ``socket://``) or on a pseudo-terminal."""

import os
import select
import socket
import threading
import time
import tty
from collections.abc import Callable
from enum import StrEnum
from functools import partial

from simlab.bench import SimulatedBench
from simlab.faults import Faults

POLL = 0.05  # s, between two looks at whether to stop
LONGEST_LINE = 64


class ThermometerFault(StrEnum):
    """What can be wrong with the thermometer or its line."""

    SILENT = "silent"
    SLOW = "slow"  # answers 0.3 s late
    GARBLED = "garbled"
    OPEN_SENSOR = "open_sensor"  # reads far too high


class ThermometerServer:
    """A running thermometer. `url` is what pyserial's ``serial_for_url`` opens."""

    def __init__(self, read_celsius: Callable[[], float], pty: bool, port: int) -> None:
        self.faults = Faults(ThermometerFault)
        self._read_celsius = read_celsius
        self._stopping = threading.Event()
        if pty:
            instrument, client = os.openpty()
            for descriptor in (instrument, client):
                tty.setraw(descriptor)
            self.url = os.ttyname(client)
            # the client's end is kept open here too, so that a client may close and open again
            serve = partial(self._serve_pty, instrument, client)
        else:
            listener = socket.create_server(("127.0.0.1", port))
            self.url = f"socket://127.0.0.1:{listener.getsockname()[1]}"
            serve = partial(self._serve_tcp, listener)
        self._thread = threading.Thread(target=serve, name="thermometer", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Close the line and end the thread."""
        self._stopping.set()
        self._thread.join()

    def _serve_pty(self, instrument: int, client: int) -> None:
        try:
            self._converse(instrument, lambda: os.read(instrument, 1024), lambda data: os.write(instrument, data))
        finally:
            os.close(instrument)
            os.close(client)

    def _serve_tcp(self, listener: socket.socket) -> None:
        with listener:
            while self._wait_for(listener.fileno()):
                connection, _ = listener.accept()
                with connection:
                    self._serve_connection(connection)

    def _serve_connection(self, connection: socket.socket) -> None:
        try:
            self._converse(connection.fileno(), lambda: connection.recv(1024), connection.sendall)
        except OSError:
            return  # the client is gone; wait for the next one

    def _converse(self, descriptor: int, receive: Callable[[], bytes], send: Callable[[bytes], object]) -> None:
        """Answer line by line until the client leaves or the server stops."""
        pending = b""
        while self._wait_for(descriptor):
            data = receive()
            if not data:
                return
            *lines, pending = (pending + data).split(b"\n")
            pending = pending[-LONGEST_LINE:]
            for line in lines:
                send(self._answer(line.strip()))

    def _answer(self, line: bytes) -> bytes:
        if self.faults.take(ThermometerFault.SILENT):
            return b""
        if self.faults.take(ThermometerFault.SLOW):
            time.sleep(0.3)
        if line != b"T?":
            return b"?\r\n"
        if self.faults.take(ThermometerFault.GARBLED):
            return b"+2\xff.1x C\r\n"
        celsius = 850.0 if self.faults.take(ThermometerFault.OPEN_SENSOR) else self._read_celsius()
        return f"{celsius:+.2f} C\r\n".encode("ascii")

    def _wait_for(self, descriptor: int) -> bool:
        """Whether there is something to read; False when the server stops."""
        while not self._stopping.is_set():
            if select.select([descriptor], [], [], POLL)[0]:
                return True
        return False


def start_thermometer_server(bench: SimulatedBench, *, pty: bool = False, port: int = 0) -> ThermometerServer:
    """Serve the temperature of the bench, on a loopback port (0: the system picks one) or a pseudo-terminal.

    Raises:
        OSError: the port is taken.
    """
    return ThermometerServer(lambda: bench.temperature(bench.clock.now()), pty, port)
