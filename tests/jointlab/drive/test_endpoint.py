"""The socket of a drive process: a program that finds many others waiting there waits with them."""

import socket
import threading
from contextlib import ExitStack, closing
from pathlib import Path

import pytest

from jointlab.drive import endpoint
from jointlab.drive.endpoint import HAS_UNIX_SOCKETS, Endpoint, NoDriveError, connect
from tests.waiting import LONG


@pytest.mark.skipif(not HAS_UNIX_SOCKETS, reason="elsewhere the operating system waits by itself")
def test_a_program_waits_where_too_many_wait_already(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(endpoint, "BACKLOG", 0)
    with ExitStack() as stack:
        listening = stack.enter_context(closing(Endpoint(tmp_path)))
        stack.enter_context(closing(connect(tmp_path, LONG)))  # the queue is full
        with pytest.raises(NoDriveError):
            connect(tmp_path, 0.1)
        connected = list[socket.socket]()
        waiting = threading.Thread(target=lambda: connected.append(connect(tmp_path, LONG)))
        waiting.start()
        waiting.join(0.3)
        assert not connected
        listening.socket.accept()[0].close()
        waiting.join(LONG)
        assert len(connected) == 1
        connected[0].close()
