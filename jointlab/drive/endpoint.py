"""Where a drive process listens for the programs that steer it: a Unix socket in its own folder.

The folder is for its user alone. Where a system has no Unix sockets, it is a loopback port, and a token that only this
user can read opens it.
"""

import hmac
import os
import secrets
import socket
import time
from contextlib import suppress
from pathlib import Path

from rig.errors import RigError

SOCKET, PORT, UNREADY = "drive.socket", "drive.port", "drive.binding"
LONGEST_PATH = 100  # bytes; the address of a Unix socket has room for 107, on some systems for 103
BACKLOG = 1024
QUEUE_PAUSE = 0.01  # s between two attempts to connect where so many wait already
HAS_UNIX_SOCKETS = hasattr(socket, "AF_UNIX")


class NoDriveError(RigError):
    """No drive process answers; it is not running, or it hangs."""


class UnansweredError(NoDriveError):
    """A drive process has got the request and has not answered: it is not known whether it does what was asked for."""


class Endpoint:
    """The listening side, until `close`. Only the process that holds the rig's lock may make one.

    Raises:
        RigError: the path of the folder is too long for a socket.
        OSError: nothing can listen there.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._token = b""
        if HAS_UNIX_SOCKETS:
            self._file, unready = folder / SOCKET, folder / UNREADY
            unready.unlink(missing_ok=True)  # of a process that was killed
            self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            self.socket.bind(_address(unready))
            unready.chmod(0o600)
            self.socket.listen(BACKLOG)
            unready.replace(self._file)  # where it is seen, it can be connected to
        else:
            self._file = folder / PORT
            self._token = secrets.token_hex(16).encode()
            self.socket = socket.create_server(("127.0.0.1", 0), backlog=BACKLOG)
            text = f"{self.socket.getsockname()[1]} {self._token.decode()}"
            self._file.unlink(missing_ok=True)
            with open(os.open(self._file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="ascii") as file:
                file.write(text)

    def is_welcome(self, connection: socket.socket) -> bool:
        """Whether a program that has connected may go on; it sends the token first, where there is one."""
        if not self._token:
            return True
        given = b""
        while len(given) < len(self._token) and (more := connection.recv(len(self._token) - len(given))):
            given += more
        return hmac.compare_digest(given, self._token)

    def close(self) -> None:
        """Stop listening."""
        self.socket.close()
        with suppress(OSError):
            self._file.unlink(missing_ok=True)


def connect(folder: Path, timeout: float) -> socket.socket:
    """A connection to the drive process of `folder`.

    Args:
        timeout: s, of connecting and of each answer.

    Raises:
        NoDriveError: no process listens there.
        RigError: the path of the folder is too long for a socket.
    """
    try:
        if HAS_UNIX_SOCKETS:
            connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            try:
                connection.settimeout(timeout)
                _queue(connection, _address(folder / SOCKET), timeout)
            except OSError:
                connection.close()
                raise
            return connection
        port, token = (folder / PORT).read_text(encoding="ascii").split()
        connection = socket.create_connection(("127.0.0.1", int(port)), timeout)
        connection.sendall(token.encode())
        return connection
    except (OSError, ValueError) as error:
        raise NoDriveError(f"no drive process answers in {folder} ({error}); start it: jointlab drive") from error


def _queue(connection: socket.socket, address: str, timeout: float) -> None:
    """Connect to a Unix socket, which refuses at once where its queue is full. Raises OSError after `timeout` s."""
    end = time.monotonic() + timeout
    while True:
        try:
            connection.connect(address)
        except BlockingIOError:
            if time.monotonic() > end:
                raise
            time.sleep(QUEUE_PAUSE)
        else:
            return


def _address(file: Path) -> str:
    if len(os.fsencode(file)) > LONGEST_PATH:
        raise RigError(
            f"{file} is too long for a socket; name a shorter folder of the drive process in the configuration"
        )
    return str(file)
