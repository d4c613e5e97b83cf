"""The relay on a serial line: on while an alarm is active, and right again after its line was lost."""

import socket
import termios
from contextlib import closing

import pytest

from jointlab.alarms import relay
from jointlab.alarms.relay import Relay
from jointlab.alarms.settings import RelaySettings
from tests.waiting import LONG, until

ON, OFF = b"\xa0\x01\x01\xa2", b"\xa0\x01\x00\xa1"


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, seconds in {"RETRY": 0.02, "REPEAT": 0.1, "LOOK": 0.01}.items():
        monkeypatch.setattr(relay, name, seconds)


def last_command(lamp: socket.socket, expected: bytes) -> None:
    """Wait until the lamp is told this, and nothing else comes after it."""
    got = b""
    while not got.endswith(expected * 3):
        got = (got + lamp.recv(4))[-12:]


# pyserial leaves the socket of a line that broke in a write to the garbage collector
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_lamp_is_on_while_an_alarm_stands_and_right_again_after_its_line_was_lost() -> None:
    standing = list[str]()
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(LONG)
        url = f"socket://127.0.0.1:{listener.getsockname()[1]}"
        settings = RelaySettings(url=url, on=ON.hex(), off=OFF.hex())
        with closing(Relay(settings, lambda: bool(standing))):
            with listener.accept()[0] as lamp:
                last_command(lamp, OFF)
                standing.append("an alarm")
                last_command(lamp, ON)
            with listener.accept()[0] as lamp:
                last_command(lamp, ON)
                standing.clear()
                last_command(lamp, OFF)


class Port:
    """A port with outputs, which a pseudo terminal does not have; opening it raises `failures` first."""

    rts, is_open = True, False

    def __init__(self, *failures: Exception) -> None:
        self.opened = list[tuple[bool, bool]]()
        self._failures = list(failures)

    def open(self) -> None:
        if self._failures:
            raise self._failures.pop()
        self.is_open = True
        self.opened.append((self.is_open, self.rts))

    def __enter__(self) -> None:
        pass

    def __exit__(self, *_: object) -> None:
        self.is_open = False


def test_an_output_of_the_port_is_set_before_the_port_is_opened_so_that_no_horn_sounds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    standing, port = list[str](), Port()
    monkeypatch.setattr("serial.serial_for_url", lambda *_, **__: port)
    with closing(Relay(RelaySettings(url="COM7", line="rts"), lambda: bool(standing))):
        until(lambda: port.opened == [(True, False)])
        standing.append("an alarm")
        until(lambda: port.rts)
        standing.clear()
        until(lambda: not port.rts)


def test_a_port_that_is_unplugged_while_it_is_set_up_is_opened_again(monkeypatch: pytest.MonkeyPatch) -> None:
    port = Port(termios.error(5, "Input/output error"), termios.error(5, "Input/output error"))
    monkeypatch.setattr("serial.serial_for_url", lambda *_, **__: port)
    with closing(Relay(RelaySettings(url="COM7", line="rts"), lambda: True)):
        until(lambda: port.opened == [(True, True)])
