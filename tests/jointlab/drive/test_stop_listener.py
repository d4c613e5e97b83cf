"""The STOP listener: it latches and answers, whatever else is connected to it or sent to it."""

import json
import socket
import threading
import time
import tracemalloc
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from dataclasses import dataclass, field

import httpx
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from jointlab.drive import stop_listener
from jointlab.drive.halter import Halter
from jointlab.drive.stop_listener import CONNECTIONS, LONGEST_LINE, StopListener
from rig.errors import RigError
from tests.waiting import LONG, until


@dataclass
class Machine:
    """What is stopped: it counts, takes a moment to come to rest, and may fail to."""

    latched: list[str] = field(default_factory=list)
    halts: int = 0
    ramp: float = 0.0  # s
    trouble: str | None = None

    def latch(self, who: str, why: str, by_person: bool) -> None:
        self.latched.append(who)

    def halt(self) -> None:
        self.halts += 1
        time.sleep(self.ramp)
        if self.trouble is not None:
            raise RigError(self.trouble)


@dataclass
class Listening:
    machine: Machine
    listener: StopListener

    def ask(self, text: bytes, timeout: float = LONG) -> bytes:
        """Send `text`, and read all that is answered."""
        with closing(self.connect(timeout)) as connection:
            connection.sendall(text)
            return b"".join(iter(lambda: connection.recv(4096), b""))

    def connect(self, timeout: float = LONG) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.listener.port), timeout)

    def stop(self) -> dict[str, object]:
        answer = httpx.post(f"http://127.0.0.1:{self.listener.port}/stop", timeout=LONG)
        document: dict[str, object] = answer.json()
        assert (answer.status_code == 200) is document["at_rest"]
        return document


@pytest.fixture
def listening() -> Iterator[Listening]:
    machine = Machine()
    halter = Halter(machine.latch, machine.halt)
    listener = StopListener("127.0.0.1", 0, halter, lambda: {"phase": "idle"})
    yield Listening(machine, listener)
    listener.close()
    halter.close()


def test_a_rig_without_a_tester_tells_nothing_of_an_actuator() -> None:
    machine = Machine()
    with (
        closing(Halter(machine.latch, machine.halt, is_driven=False)) as halter,
        closing(StopListener("127.0.0.1", 0, halter, dict)) as listener,
    ):
        answer = httpx.post(f"http://127.0.0.1:{listener.port}/stop", timeout=LONG)
    assert answer.status_code == 200
    assert answer.json() == {
        "latched": True, "at_rest": None, "detail": "STOP is in force; this rig drives no tester"
    }  # fmt: skip
    assert machine.latched
    assert machine.halts == 1


def test_a_stop_of_the_page_is_answered_when_the_actuator_is_at_rest(listening: Listening) -> None:
    listening.machine.ramp = 0.1
    began = time.monotonic()
    assert listening.stop() == {"latched": True, "at_rest": True, "detail": "the actuator is at rest"}
    assert time.monotonic() - began >= 0.1
    assert listening.machine.latched == ["STOP listener, from 127.0.0.1"]


def test_a_page_of_any_origin_may_ask_and_read_the_answer(listening: Listening) -> None:
    address, origin = f"http://127.0.0.1:{listening.listener.port}/stop", {"Origin": "http://laboratory:8000"}
    asked = httpx.options(address, headers=origin | {"Access-Control-Request-Method": "POST"})
    assert (asked.status_code, asked.headers["access-control-allow-origin"]) == (204, "*")
    assert httpx.post(address, headers=origin).headers["access-control-allow-origin"] == "*"


def test_one_line_stops_too_even_where_its_sender_sends_no_more(listening: Listening) -> None:
    listening.machine.ramp = 0.1
    with closing(listening.connect()) as connection:
        connection.sendall(b"STOP\n")
        connection.shutdown(socket.SHUT_WR)
        assert json.loads(connection.recv(4096))["at_rest"] is True


@pytest.mark.parametrize("text", [b"STOP", b"POST /stop HTTP/1.1"])
def test_a_complete_word_stops_without_a_line_end_once_its_sender_sends_no_more(
    listening: Listening, text: bytes
) -> None:
    with closing(listening.connect()) as connection:
        connection.sendall(text)
        connection.shutdown(socket.SHUT_WR)
        assert b'"at_rest": true' in connection.recv(4096)
    assert len(listening.machine.latched) == 1


@pytest.mark.parametrize("text", [b"", b"STO", b"POST /sto"])
def test_a_part_of_a_word_stops_nothing(listening: Listening, text: bytes) -> None:
    with closing(listening.connect()) as connection:
        connection.sendall(text)
        connection.shutdown(socket.SHUT_WR)
        assert b"latched" not in connection.recv(4096)
    assert not listening.machine.latched


def test_a_line_that_a_slow_link_delays_is_waited_for(listening: Listening) -> None:
    with closing(listening.connect()) as connection:
        time.sleep(3.0)
        connection.sendall(b"STOP\n")
        assert json.loads(connection.recv(4096))["at_rest"] is True


def test_a_stop_that_is_not_confirmed_says_so_and_is_latched_all_the_same(
    listening: Listening, monkeypatch: pytest.MonkeyPatch
) -> None:
    listening.machine.trouble = "tcp://tester: no reply"
    assert listening.stop() == {"latched": True, "at_rest": False, "detail": "tcp://tester: no reply"}
    monkeypatch.setattr(stop_listener, "ANSWER_TIMEOUT", 0.1)
    listening.machine.ramp = 1.0
    answer = listening.stop()
    assert answer["at_rest"] is False
    assert "latched; the actuator was not confirmed" in str(answer["detail"])
    assert len(listening.machine.latched) == 2


def test_the_state_is_told_and_anything_else_is_no_stop(listening: Listening) -> None:
    assert json.loads(listening.ask(b"STATE\n")) == {"phase": "idle"}
    assert listening.ask(b"GET /state HTTP/1.1\r\n\r\n").endswith(b'{"phase": "idle"}\n')
    for other in (b"GET /stop HTTP/1.1\r\n\r\n", b"POST / HTTP/1.1\r\n\r\n", b"\n"):
        assert b"write POST /stop" in listening.ask(other)
    assert not listening.machine.latched


def test_a_stop_gets_through_two_thousand_half_open_requests(listening: Listening) -> None:
    with ExitStack() as opened:
        for number in range(2000):
            each = opened.enter_context(closing(listening.connect()))
            if number % 2:
                each.sendall(b"POST /sto")
            if number % 100 == 99:
                assert listening.stop()["at_rest"] is True  # how soon: bench_stop
    assert len(listening.machine.latched) == 20


def test_three_hundred_stops_at_once_are_all_latched_and_answered_after_few_halts(listening: Listening) -> None:
    listening.machine.ramp = 0.2
    together = threading.Barrier(300)

    def press(_: int) -> bytes:
        together.wait(LONG)
        return listening.ask(b"POST /stop HTTP/1.1\r\n\r\n")

    with ThreadPoolExecutor(300) as pressing:
        answers = list(pressing.map(press, range(300)))
    assert len(listening.machine.latched) == 300
    assert all(b'"at_rest": true' in answer for answer in answers)
    assert listening.machine.halts <= 10


def test_more_stops_than_may_wait_are_told_that_it_is_latched(
    listening: Listening, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stop_listener, "CONNECTIONS", 8)
    monkeypatch.setattr(stop_listener, "WAITING", 6)
    listening.machine.ramp = 1.0
    with ExitStack() as opened:
        asking = []
        for number in range(20):
            asking.append(opened.enter_context(closing(listening.connect())))
            asking[-1].sendall(b"STOP\n")
            while len(listening.machine.latched) <= number:
                time.sleep(0.002)
        answers = [json.loads(each.recv(4096)) for each in asking]
    assert all(answer["latched"] for answer in answers)
    assert [answer["at_rest"] for answer in answers] == [False] * 12 + [True] * 8


def test_senders_of_a_byte_at_a_time_keep_no_place(listening: Listening) -> None:
    slow = [listening.connect() for _ in range(CONNECTIONS)]
    over = threading.Event()

    def trickle() -> None:
        while not over.wait(0.05):
            for each in slow:
                try:
                    each.send(b"x")
                except OSError:
                    continue

    thread = threading.Thread(target=trickle)
    thread.start()
    try:
        for _ in range(5):
            assert listening.stop()["at_rest"] is True
        until(lambda: all(_is_closed(each) for each in slow))
    finally:
        over.set()
        thread.join()
        for each in slow:
            each.close()


def _is_closed(connection: socket.socket) -> bool:
    connection.setblocking(False)
    try:
        return connection.recv(1) == b""
    except BlockingIOError:
        return False
    except OSError:
        return True


def test_a_large_body_is_neither_kept_nor_waited_for(listening: Listening) -> None:
    head, piece, size = b"POST /stop HTTP/1.1\r\nContent-Length: 500000000\r\n\r\n", bytes(2**20), 500_000_000
    over = threading.Event()

    def send() -> None:
        with closing(listening.connect()) as connection:
            connection.sendall(head)
            for _ in range(size // len(piece)):
                try:
                    connection.sendall(piece)
                except OSError:
                    break  # it was cut off
        over.set()

    tracemalloc.start()
    thread = threading.Thread(target=send)
    thread.start()
    stops = 0
    while not over.is_set() or not stops:
        assert listening.stop()["at_rest"] is True
        stops += 1
    thread.join()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20e6


@given(st.binary(max_size=3 * LONGEST_LINE))
@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_garbage_is_answered_or_cut_off_and_the_next_stop_works(listening: Listening, garbage: bytes) -> None:
    with closing(listening.connect()) as connection:
        try:
            connection.sendall(garbage)
            connection.shutdown(socket.SHUT_WR)
            while connection.recv(4096):
                pass
        except OSError:
            pass  # cut off
    assert listening.stop()["at_rest"] is True


def test_a_halter_halts_once_more_for_a_stop_that_came_during_a_halt() -> None:
    machine, began, go_on = Machine(), threading.Event(), threading.Event()

    def halt() -> None:
        machine.halt()
        began.set()
        go_on.wait(LONG)

    halter = Halter(machine.latch, halt)
    first = halter.press("one")
    assert began.wait(LONG)
    others = [halter.press(str(number)) for number in range(100)]
    assert halter.outcome(first) is None
    go_on.set()
    outcome = halter.wait(others[-1], LONG)
    assert outcome is not None
    assert outcome.at_rest
    assert machine.halts == 2
    halter.close()


def test_a_halter_halts_also_where_telling_of_the_stop_fails() -> None:
    machine = Machine()

    def latch(who: str, why: str, by_person: bool) -> None:
        raise MemoryError

    halter = Halter(latch, machine.halt)
    with pytest.raises(MemoryError):
        halter.press("one")
    until(lambda: machine.halts == 1)
    halter.close()
