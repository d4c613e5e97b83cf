"""The simulated thermometer as its line shows it."""

from collections.abc import Iterator

import pytest
import serial

from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.thermometer_server import ThermometerServer, start_thermometer_server


@pytest.fixture(params=["socket", "pty"])
def server(request: pytest.FixtureRequest) -> Iterator[ThermometerServer]:
    server = start_thermometer_server(ordinary_bench(3, Clock()), pty=request.param == "pty")
    yield server
    server.stop()


def ask(server: ThermometerServer, question: bytes) -> bytes:
    with serial.serial_for_url(server.url, timeout=0.5) as port:
        port.write(question)
        return bytes(port.readline())


def test_it_answers_the_benchs_temperature_to_a_hundredth(server: ThermometerServer) -> None:
    answer = ask(server, b"T?\n")
    assert answer.endswith(b" C\r\n")
    assert float(answer.split()[0]) == pytest.approx(ordinary_bench(3, Clock()).temperature(0.0), abs=0.011)


def test_it_does_not_know_other_questions(server: ThermometerServer) -> None:
    assert ask(server, b"P?\n") == b"?\r\n"


def test_it_waits_for_the_end_of_the_line(server: ThermometerServer) -> None:
    with serial.serial_for_url(server.url, timeout=0.1) as port:
        port.write(b"T")
        assert port.readline() == b""
        port.write(b"?\n")
        assert port.readline().endswith(b"C\r\n")


def test_one_client_may_follow_another(server: ThermometerServer) -> None:
    assert ask(server, b"T?\n")
    assert ask(server, b"T?\n")


def test_an_unknown_fault_is_refused(server: ThermometerServer) -> None:
    with pytest.raises(ValueError, match="no fault 'melted'"):
        server.faults.set("melted")
