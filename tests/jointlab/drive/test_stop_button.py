"""The STOP button on a serial line: a byte is STOP, and so is a lost line, until it is back."""

import socket
from collections.abc import Iterator
from contextlib import closing

import pytest

from jointlab.drive import stop_button
from jointlab.drive.stop_button import StopButton
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
