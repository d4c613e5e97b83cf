"""Signs of life: who gets them, and that nothing waits for who does not take them."""

import os
import socket
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from jointlab.systemd import SignsOfLife
from tests.waiting import LONG

SIGN = b"READY=1\nWATCHDOG=1"
Line = socket.socket


@pytest.fixture
def line(monkeypatch: pytest.MonkeyPatch) -> Iterator[Line]:
    """Where systemd would listen."""
    with TemporaryDirectory() as folder, closing(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)) as listening:
        address = str(Path(folder) / "notify")
        listening.bind(address)
        listening.settimeout(LONG)
        monkeypatch.setenv("NOTIFY_SOCKET", address)
        yield listening


def test_nothing_is_told_where_no_systemd_listens(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    SignsOfLife().give()


def test_a_sign_is_given_once_a_second_and_not_by_processes_that_this_one_starts(line: Line) -> None:
    signs = SignsOfLife()
    assert "NOTIFY_SOCKET" not in os.environ
    signs.give()
    assert line.recv(100) == SIGN
    signs.give()
    line.setblocking(False)
    with pytest.raises(BlockingIOError):
        line.recv(100)


def test_a_systemd_that_does_not_listen_any_more_is_told_of_in_the_log(
    line: Line, caplog: pytest.LogCaptureFixture
) -> None:
    line.close()
    SignsOfLife().give()
    assert "systemd cannot be told" in caplog.text
