"""The STOP listener: a socket of its own, served by one thread that waits for nothing but sockets.

It needs no key. The first line of a request decides, and headers and body behind it are never kept: `POST /stop` of
HTTP (the page's button), or the plain line `STOP`. `GET /state` and `STATE` say what the machine does. Memory is
constant: a fixed number of connections, each with one line. Where all places are taken, the oldest connection that has
its answer is dropped, or else the oldest without a request. The cost of a connection does not grow with their number,
because a press may wait behind a thousand.
"""

import json
import logging
import selectors
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from typing import Any

from jointlab.drive.halter import Halted, Halter

CONNECTIONS = 480
"""Connections at a time: less than the 512 that `select` takes on Windows and the 1,024 descriptors of a process."""
WAITING = 360
"""Of these, the connections that may wait for the actuator at rest; the others are left for those that come."""
BACKLOG = 1024
LONGEST_LINE = 1024  # bytes of a request that are kept
LINE_TIMEOUT = 20.0  # s for the first line of a request, on a link however slow; the oldest gives way anyway
ANSWER_TIMEOUT = 3.0  # s that an answer waits for the actuator at rest
DRAIN_TIME = 0.5  # s that a connection stays after the answer; closing at once would lose the answer on its way
MOST_READ = 65_536  # bytes that are read of a request; the rest of a large body stays with its sender
TICK = 0.1  # s between two looks for connections whose time is over
CHUNK = 16_384
CORS = (
    "Access-Control-Allow-Origin: *\r\nAccess-Control-Allow-Methods: POST, GET\r\n"
    "Access-Control-Allow-Headers: *\r\nAccess-Control-Allow-Private-Network: true\r\n"
)
STATUS = {200: "OK", 204: "No Content", 404: "Not Found", 502: "Bad Gateway"}
log = logging.getLogger(__name__)


@dataclass(eq=False)
class _Connection:
    """One connection.

    Attributes:
        until: when its present phase has to be over, by the monotonic clock.
        line: what came of the first line.
        request: number of the halt whose outcome it waits for.
        http: whether the answer is one of HTTP.
        answer: what is still to be sent; None before there is an answer.
        read: bytes so far.
        watched: events that the selector waits for.
    """

    socket: socket.socket
    peer: str
    until: float
    line: bytearray = field(default_factory=bytearray)
    request: int | None = None
    http: bool = False
    answer: bytes | None = None
    read: int = 0
    watched: int = 0


class StopListener:
    """Answers on `address` until it is closed.

    Args:
        address, port: to listen on; port 0 is any free one.
        halter: latches and halts.
        state: what the machine does, as JSON has it; it must not block.

    Attributes:
        port: that it listens on.

    Raises:
        OSError: nothing can listen there.
    """

    def __init__(self, address: str, port: int, halter: Halter, state: Callable[[], dict[str, Any]]) -> None:
        self._halter = halter
        self._state = state
        self._listener = socket.create_server(
            (address, port), family=socket.AF_INET6 if ":" in address else socket.AF_INET, backlog=BACKLOG
        )
        self._listener.setblocking(False)
        self.port: int = self._listener.getsockname()[1]
        self._waker, self._woken = socket.socketpair()
        self._waker.setblocking(False)
        self._woken.setblocking(False)
        # in the order in which they came: those that have asked for nothing, that wait for rest, that have an answer
        self._asking, self._waiting, self._answered = (dict[_Connection, None]() for _ in range(3))
        self._look = 0.0  # when connections whose time is over are looked for
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._selector.register(self._woken, selectors.EVENT_READ)
        self._closed = False
        halter.finished = self._wake
        self._thread = threading.Thread(target=self._run, name="STOP listener", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening."""
        self._closed = True
        self._wake()
        self._thread.join()
        self._halter.finished = lambda: None
        for connection in self._all():
            self._drop(connection)
        for each in (self._listener, self._waker, self._woken):
            each.close()
        self._selector.close()

    def _wake(self) -> None:
        with suppress(BlockingIOError):  # it is woken already
            self._waker.send(b"\0")

    def _run(self) -> None:
        while not self._closed:
            try:
                self._turn()
            except Exception:  # whatever one turn met, the next STOP is answered
                log.exception("the STOP listener met an unexpected error")
                time.sleep(TICK)

    def _turn(self) -> None:
        for key, _ in self._selector.select(TICK):
            if key.fileobj is self._listener:
                self._accept()
            elif key.fileobj is self._woken:
                self._woken.recv(CHUNK)
            elif key.data.watched:  # not dropped for a new one in this turn
                self._serve(key.data)
        now = time.monotonic()
        for connection in tuple(self._waiting):
            assert connection.request is not None, "it waits for a halt"
            outcome = self._halter.outcome(connection.request)
            if outcome is not None or now > connection.until:
                self._tell(connection, outcome)
        if now > self._look:
            self._look = now + TICK
            for connection in self._all():
                if now > connection.until:
                    self._drop(connection)

    def _all(self) -> tuple[_Connection, ...]:
        return *self._asking, *self._waiting, *self._answered

    def _accept(self) -> None:
        for _ in range(CONNECTIONS):  # then it is the turn of those that are here
            try:
                accepted, peer = self._listener.accept()
            except BlockingIOError:
                return
            except OSError as error:  # it has gone already, or there is no descriptor left
                log.warning("STOP listener: %s", error)
                if self._asking or self._waiting or self._answered:
                    self._make_place()
                return
            if len(self._asking) + len(self._waiting) + len(self._answered) >= CONNECTIONS:
                self._make_place()
            accepted.setblocking(False)
            connection = _Connection(accepted, str(peer[0]), time.monotonic() + LINE_TIMEOUT)
            self._asking[connection] = None
            self._watch(connection, selectors.EVENT_READ)
            self._serve(connection)  # its line is here in most cases, and then nobody makes it wait

    def _make_place(self) -> None:
        """Drop the oldest connection that has its answer or has asked for nothing.

        Where too many wait for the actuator, the oldest of them is told that STOP is latched, and dropped.
        """
        if len(self._waiting) > WAITING or not (self._asking or self._answered):
            oldest = next(iter(self._waiting))
            self._tell(oldest, None)
            self._drop(oldest)
        else:
            self._drop(next(iter(self._answered or self._asking)))

    def _serve(self, connection: _Connection) -> None:
        try:
            if connection.answer:
                self._send(connection)
                return
            received = connection.socket.recv(CHUNK)
        except BlockingIOError:
            return
        except OSError:
            self._drop(connection)
            return
        connection.read += len(received)
        if not received and connection in self._asking and connection.line:
            self._obey(connection, connection.line.strip())  # its sender sends no more, and no line end
        elif not received and connection not in self._waiting:
            self._drop(connection)
        elif not received or connection.read > MOST_READ:
            self._watch(connection, 0)  # it has sent all, or too much, and may wait for the answer
        elif connection in self._asking:
            connection.line += received[: LONGEST_LINE - len(connection.line)]
            line, newline, _ = bytes(connection.line).partition(b"\n")
            if newline:
                self._obey(connection, line.strip())
            elif len(connection.line) >= LONGEST_LINE:
                self._drop(connection)

    def _obey(self, connection: _Connection, line: bytes | bytearray) -> None:
        words = line.split()
        connection.http = len(words) == 3 and words[2].startswith(b"HTTP/")
        match words[:2]:
            case [b"POST", b"/stop"] | [b"STOP", *_]:
                connection.request = self._halter.press(f"STOP listener, from {connection.peer}")
                connection.until = time.monotonic() + ANSWER_TIMEOUT
                self._move(connection, self._waiting)
            case [b"GET", b"/state"] | [b"STATE"]:
                self._answer(connection, 200, self._state())
            case [b"OPTIONS", _]:
                self._answer(connection, 204, {})
            case _:
                self._answer(connection, 404, {"detail": "write POST /stop, GET /state, or the line STOP or STATE"})

    def _tell(self, connection: _Connection, outcome: Halted | None) -> None:
        said = outcome or Halted(False, "STOP is latched; the actuator was not confirmed at rest yet")
        self._answer(connection, 502 if said.at_rest is False else 200, {"latched": True, **asdict(said)})

    def _answer(self, connection: _Connection, status: int, document: dict[str, Any]) -> None:
        body = b"" if status == 204 else json.dumps(document).encode() + b"\n"
        if connection.http:
            head = (
                f"HTTP/1.1 {status} {STATUS[status]}\r\n{CORS}Content-Type: application/json\r\n"
                f"Content-Length: {len(body)}\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n"
            )
            body = head.encode() + body
        connection.answer, connection.until = body, time.monotonic() + ANSWER_TIMEOUT
        self._move(connection, self._answered)
        self._send(connection)

    def _send(self, connection: _Connection) -> None:
        assert connection.answer is not None
        try:
            connection.answer = connection.answer[connection.socket.send(connection.answer) :]
            events = selectors.EVENT_WRITE if connection.answer else selectors.EVENT_READ
            if not connection.answer:  # some of what still comes is read and forgotten
                connection.until = time.monotonic() + DRAIN_TIME
                connection.socket.shutdown(socket.SHUT_WR)
            self._watch(connection, events)
        except BlockingIOError:
            self._watch(connection, selectors.EVENT_WRITE)
        except OSError:
            self._drop(connection)

    def _watch(self, connection: _Connection, events: int) -> None:
        """Wait for these events of a connection, and no others; 0: for none."""
        if connection.watched and not events:
            self._selector.unregister(connection.socket)
        elif connection.watched and events != connection.watched:
            self._selector.modify(connection.socket, events, connection)
        elif not connection.watched and events:
            self._selector.register(connection.socket, events, connection)
        connection.watched = events

    def _move(self, connection: _Connection, to: dict[_Connection, None]) -> None:
        self._leave(connection)
        to[connection] = None

    def _leave(self, connection: _Connection) -> None:
        for kind in (self._asking, self._waiting, self._answered):
            kind.pop(connection, None)

    def _drop(self, connection: _Connection) -> None:
        self._leave(connection)
        self._watch(connection, 0)
        connection.socket.close()
