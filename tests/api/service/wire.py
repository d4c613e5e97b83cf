"""A client that speaks HTTP/1.1 by hand: whatever a well-behaved one would not send."""

import socket
from collections.abc import Iterable
from urllib.parse import urlsplit

import httpx

from tests.waiting import LONG

PATIENCE = LONG


def connected(client: httpx.Client) -> socket.socket:
    """A connection to the service of a client."""
    address = urlsplit(str(client.base_url))
    assert address.hostname is not None
    return socket.create_connection((address.hostname, address.port or 80), timeout=PATIENCE)


def head(method: str, path: str, *headers: str) -> bytes:
    """A request up to the beginning of its body."""
    return "\r\n".join((f"{method} {path} HTTP/1.1", "Host: 127.0.0.1", *headers, "", "")).encode()


def answer(connection: socket.socket) -> tuple[int, str]:
    """The status and the rest of what is answered next: as much as comes at once."""
    came = b""
    while b"\r\n\r\n" not in came:
        piece = connection.recv(65536)
        assert piece, f"the connection was closed after {came!r}"
        came += piece
    return int(came.split(b" ", 2)[1]), came.decode()


def pour(connection: socket.socket, pieces: Iterable[bytes]) -> int:
    """Send pieces until the service closes the connection; the number of bytes that were sent."""
    sent = 0
    try:
        for piece in pieces:
            connection.sendall(piece)
            sent += len(piece)
    except (BrokenPipeError, ConnectionResetError):
        pass
    return sent
