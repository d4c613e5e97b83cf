"""A small broker of MQTT 3.1.1 on loopback, in a process of its own that a test may kill.

It keeps what is retained in memory, passes messages on with quality 0 or 1, says last wills and checks one user. A
second broker, amqtt, is used where it is installed: it is in no lock, because it asks for an old version of websockets.
"""

import argparse
import asyncio
import socketserver
import ssl
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

CONNECT, PUBLISH, PUBACK, SUBSCRIBE, PINGREQ, DISCONNECT = 1, 3, 4, 8, 12, 14
CONNACK, SUBACK, PINGRESP = 0x20, 0x90, 0xD0
WRONG_PASSWORD = 4
READY = "ready"
ROOT = Path(__file__).resolve().parents[1]


@contextmanager
def broker_process(kind: str, port: int, *options: object) -> Iterator["subprocess.Popen[str]"]:
    """A broker, "small" or "amqtt", in a process of its own; skips the test where it is not installed."""
    if kind == "amqtt" and find_spec("amqtt") is None:
        pytest.skip("amqtt is not installed")
    command = [sys.executable, "-m", "tests.mqtt_broker", kind, str(port), *map(str, options)]
    quiet = subprocess.DEVNULL
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=quiet, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline().strip() == READY
            yield process
        finally:
            process.kill()


@dataclass
class State:
    """What all connections share."""

    user: tuple[str, str] | None
    lock: threading.Lock = field(default_factory=threading.Lock)
    retained: dict[str, bytes] = field(default_factory=dict)
    readers: "dict[Connection, list[str]]" = field(default_factory=dict)

    def spread(self, topic: str, payload: bytes, *, retain: bool) -> None:
        with self.lock:
            if retain:
                self.retained[topic] = payload
            for reader, filters in self.readers.items():
                if any(fits(each, topic) for each in filters):
                    reader.send(PUBLISH << 4, text(topic) + payload)


class Connection(socketserver.BaseRequestHandler):
    """One client."""

    server: "Server"

    def handle(self) -> None:
        state, will = self.server.state, None
        try:
            while True:
                kind, flags, body = self._packet()
                if kind == CONNECT:
                    will, allowed = self._connect(body)
                    self.send(CONNACK, bytes((0, 0 if allowed else WRONG_PASSWORD)))
                    if not allowed:
                        return
                elif kind == PUBLISH:
                    topic, rest = taken(body)
                    if flags & 0x06:
                        number, rest = rest[:2], rest[2:]
                    state.spread(topic.decode(), rest, retain=bool(flags & 1))
                    if flags & 0x06:
                        self.send(PUBACK << 4, number)
                elif kind == SUBSCRIBE:
                    self._subscribe(body)
                elif kind == PINGREQ:
                    self.send(PINGRESP, b"")
                elif kind == DISCONNECT:
                    will = None
                    return
        except OSError:
            return  # the client has gone; the last will says so
        finally:
            with state.lock:
                state.readers.pop(self, None)
            if will is not None:
                state.spread(*will, retain=True)

    def send(self, head: int, body: bytes) -> None:
        length, left = bytearray(), len(body)
        while True:
            left, low = divmod(left, 128)
            length.append(low | (0x80 if left else 0))
            if not left:
                break
        self.request.sendall(bytes((head,)) + bytes(length) + body)

    def _packet(self) -> tuple[int, int, bytes]:
        (head,) = self._read(1)
        length, shift = 0, 0
        while True:
            (part,) = self._read(1)
            length |= (part & 0x7F) << shift
            shift += 7
            if part < 0x80:
                return head >> 4, head & 0x0F, self._read(length)

    def _read(self, count: int) -> bytes:
        found = b""
        while len(found) < count:
            piece = self.request.recv(count - len(found))
            if not piece:
                raise ConnectionResetError
            found += piece
        return found

    def _connect(self, body: bytes) -> tuple[tuple[str, bytes] | None, bool]:
        """The last will, and whether the client may enter."""
        _, rest = taken(body)
        flags = rest[1]
        _, rest = taken(rest[4:])
        will = None
        if flags & 0x04:
            topic, rest = taken(rest)
            payload, rest = taken(rest)
            will = topic.decode(), payload
        given = []
        for flag in (0x80, 0x40):
            value, rest = taken(rest) if flags & flag else (b"", rest)
            given.append(value.decode())
        return will, self.server.state.user in (None, tuple(given))

    def _subscribe(self, body: bytes) -> None:
        state, number, rest, filters = self.server.state, body[:2], body[2:], []
        while rest:
            name, rest = taken(rest)
            filters.append(name.decode())
            rest = rest[1:]
        with state.lock:
            self.send(SUBACK, number + bytes(len(filters)))
            for topic, payload in state.retained.items():
                if any(fits(each, topic) for each in filters):
                    self.send(PUBLISH << 4 | 1, text(topic) + payload)
            state.readers[self] = filters


class Server(socketserver.ThreadingTCPServer):
    allow_reuse_address = True
    daemon_threads = True

    def __init__(self, port: int, state: State, tls: ssl.SSLContext | None) -> None:
        self.state = state
        self.tls = tls
        super().__init__(("127.0.0.1", port), Connection)

    def get_request(self) -> tuple[Any, Any]:
        connection, address = super().get_request()
        return (connection if self.tls is None else self.tls.wrap_socket(connection, server_side=True)), address


def text(value: str) -> bytes:
    return struct.pack("!H", len(value.encode())) + value.encode()


def taken(body: bytes) -> tuple[bytes, bytes]:
    """The field with a length that `body` begins with, and the rest."""
    (length,) = struct.unpack("!H", body[:2])
    return body[2 : 2 + length], body[2 + length :]


def fits(wanted: str, topic: str) -> bool:
    return topic == wanted or (wanted.endswith("#") and topic.startswith(wanted[:-1]))


async def run_amqtt(port: int) -> None:
    broker = import_module("amqtt.broker").Broker(
        {
            "listeners": {"default": {"type": "tcp", "bind": f"127.0.0.1:{port}"}},
            "plugins": {"amqtt.plugins.authentication.AnonymousAuthPlugin": {"allow_anonymous": True}},
        }
    )
    await broker.start()
    print(READY, flush=True)
    await asyncio.Event().wait()


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("kind", choices=("small", "amqtt"))
    parser.add_argument("port", type=int)
    parser.add_argument("--user", nargs=2)
    parser.add_argument("--tls", nargs=2)
    given = parser.parse_args()
    if given.kind == "amqtt":
        asyncio.run(run_amqtt(given.port))
    tls = None
    if given.tls is not None:
        tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        tls.load_cert_chain(*given.tls)
    state = State(None if given.user is None else (given.user[0], given.user[1]))
    server = Server(given.port, state, tls)
    print(READY, flush=True)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    while True:
        time.sleep(3600)


if __name__ == "__main__":
    main()
