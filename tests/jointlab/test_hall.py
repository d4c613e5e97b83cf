"""A hall does not believe a listener for longer, or in more, than it said."""

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field

import pytest

from jointlab.hall import FRESH, LONGEST_ANSWER, Hall, ask
from jointlab.settings import HallRig, Settings
from rig.errors import RigError
from tests.waiting import LONG, until

IDLE = (
    b'{"rig": "B1", "phase": "idle", "run_id": null, "activity": "", "reason": null, "interlocks": [], '
    b'"tester_silent": null, "stop": null}\n'
)


@dataclass
class Listener:
    """Answers each line with what the test says."""

    server: socket.socket
    answers: dict[bytes, bytes] = field(default_factory=dict)

    @property
    def rig(self) -> HallRig:
        return HallRig(rig="B1", stop_address="127.0.0.1", stop_port=self.server.getsockname()[1], page=None)

    def run(self) -> None:
        while True:
            try:
                connection = self.server.accept()[0]
            except OSError:
                return
            with connection:
                connection.sendall(self.answers.get(connection.recv(100), b""))


@pytest.fixture
def listener() -> Iterator[Listener]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        listener = Listener(server, {b"STATE\n": IDLE})
        thread = threading.Thread(target=listener.run)
        thread.start()
        yield listener
        server.shutdown(socket.SHUT_RDWR)
        thread.join()


def test_a_state_is_told_only_while_it_is_fresh(listener: Listener) -> None:
    late = 0.0
    with closing(Hall([listener.rig], now=lambda: time.monotonic() + late)) as hall:
        until(lambda: hall.seen()[0].state is not None)
    assert hall.seen()[0].trouble == ""
    late = FRESH + 1.0  # nobody looks any more
    seen = hall.seen()[0]
    assert (seen.state, seen.trouble) == (None, "it does not answer in time")
    assert seen.heard_at is not None


def test_an_answer_that_is_not_understood_is_no_state(listener: Listener) -> None:
    listener.answers[b"STATE\n"] = IDLE.replace(b"idle", b"asleep")
    with closing(Hall([listener.rig])) as hall:
        until(lambda: hall.seen()[0].trouble == "its answer is not understood")
        assert hall.seen()[0].state is None


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        (b'{"at_rest": false, "detail": "no reply"}', "B1: no reply"),
        (b"", "its answer is not understood"),
        (b'{"at_rest": 17}', "its answer is not understood"),
    ],
)
def test_a_stop_that_is_not_confirmed_says_so(listener: Listener, answer: bytes, why: str) -> None:
    listener.answers[b"STOP\n"] = answer
    with closing(Hall([listener.rig])) as hall, pytest.raises(RigError, match=f"{why}.*red button"):
        hall.stop("B1")


def test_an_answer_without_an_end_is_not_read_for_ever(listener: Listener) -> None:
    listener.answers[b"STATE\n"] = b"x" * (LONGEST_ANSWER + 10_000)
    with pytest.raises(TimeoutError, match="does not end"):
        ask("127.0.0.1", listener.rig.stop_port, b"STATE\n", LONG)


def test_each_rig_has_a_name_of_its_own() -> None:
    twice = HallRig(rig="B1", stop_address="127.0.0.1", page=None)
    with pytest.raises(ValueError, match="two rigs of the hall have one name"):
        Settings(hall=(twice, twice))
