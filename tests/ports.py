"""Ports of this computer for tests."""

import random
import socket

LISTENED = range(15_000, 32_000)
"""TCP ports below those that systems give to clients, and to servers that ask for any."""

_draw = random.SystemRandom()  # processes that run tests side by side draw different ones, whatever seeds they set


def free_port() -> int:
    """A TCP port that nobody uses now, and that the system does not give to somebody else before it is used."""
    while True:
        port = _draw.choice(LISTENED)
        try:
            socket.create_server(("127.0.0.1", port)).close()
        except OSError:
            continue
        return port
