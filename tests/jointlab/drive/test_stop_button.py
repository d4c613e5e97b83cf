"""The STOP button on a serial line: a byte is STOP, and so is a lost line, until it is back."""

import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing

import pytest
import serial

from jointlab.drive import stop_button
from jointlab.drive.stop_button import KEEPALIVE, StopButton
from tests.waiting import until

Presses = list[tuple[str, str, bool]]


@pytest.fixture
def presses() -> Presses:
    return []


@pytest.fixture
def line(monkeypatch: pytest.MonkeyPatch) -> Iterator[socket.socket]:
    """Where the button's line ends."""
    monkeypatch.setattr(stop_button, "RETRY", 0.05)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield listener


def test_a_byte_is_stop_and_a_lost_line_is_stop_until_it_is_back(line: socket.socket, presses: Presses) -> None:
    url = f"socket://127.0.0.1:{line.getsockname()[1]}"
    with closing(StopButton(url, lambda who, why, by_person: presses.append((who, why, by_person)))):
        for _ in range(2):
            with line.accept()[0] as button:
                presses.clear()
                until(lambda: button.send(b"\x01") > 0 and bool(presses))
                assert set(presses) == {(f"button at {url}", "the button was pressed", True)}
            until(lambda: presses[-1] == (f"button at {url}", "its line is lost", False))


@pytest.mark.parametrize("url", ["socket://127.0.0.1:9", "sockt://h:1"])
def test_a_line_that_cannot_be_opened_is_stop(presses: Presses, monkeypatch: pytest.MonkeyPatch, url: str) -> None:
    monkeypatch.setattr(stop_button, "RETRY", 0.01)
    with closing(StopButton(url, lambda who, why, by_person: presses.append((who, why, by_person)))):
        until(lambda: len(presses) > 3)
    assert {each[1:] for each in presses} == {("its line is lost", False)}


OWN_NETWORK = ["unshare", "--map-root-user", "--net"]
DEAD_LINE = """
import os, socket, subprocess, sys, threading
from jointlab.drive.stop_button import StopButton

def link(state):
    subprocess.run(["ip", "link", "set", "lo", state], check=True)

link("up")
pressed, lost = threading.Event(), threading.Event()
with socket.create_server(("127.0.0.1", 0)) as listener:
    url = f"socket://127.0.0.1:{listener.getsockname()[1]}"
    StopButton(url, lambda who, why, by_person: (pressed if by_person else lost).set())
    button, _ = listener.accept()
    while not pressed.wait(0.1):  # what comes while the line is opened is dropped
        button.sendall(b"1")
    assert not lost.is_set()
    link("down")  # each packet vanishes
    os._exit(0 if lost.wait(300) else 1)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux gives a process a network of its own")
def test_a_network_line_that_goes_dead_is_stop() -> None:
    if subprocess.run([*OWN_NETWORK, "ip", "link"], capture_output=True, check=False).returncode:
        pytest.skip("the dead line needs a network namespace, which this user may not make (unshare)")
    subprocess.run([*OWN_NETWORK, sys.executable, "-c", DEAD_LINE], check=True)


def test_a_network_line_is_watched_by_the_operating_system(line: socket.socket) -> None:
    with serial.serial_for_url(f"socket://127.0.0.1:{line.getsockname()[1]}") as button:
        stop_button._keep_alive(button)
        connection: socket.socket = vars(button)["_socket"]
        assert connection.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE) == 1
        for name in {"TCP_KEEPINTVL", "TCP_KEEPCNT", "TCP_USER_TIMEOUT"} & set(dir(socket)):
            assert connection.getsockopt(socket.IPPROTO_TCP, getattr(socket, name)) == KEEPALIVE[name]
