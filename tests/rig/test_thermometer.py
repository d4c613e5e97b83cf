"""The thermometer's driver against the simulated thermometer on a socket and on a pseudo-terminal."""

import gc
import time
from collections.abc import Iterator

import pytest

from rig.thermometer import Thermometer, ThermometerError
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.thermometer_server import ThermometerServer, start_thermometer_server

TIMEOUT = 0.2


@pytest.fixture
def server() -> Iterator[ThermometerServer]:
    server = start_thermometer_server(ordinary_bench(3, Clock()), pty=True)
    yield server
    server.stop()


@pytest.fixture
def thermometer(server: ThermometerServer) -> Iterator[Thermometer]:
    with Thermometer(server.url, TIMEOUT) as thermometer:
        yield thermometer


@pytest.mark.parametrize("pty", [True, False], ids=["pty", "socket"])
def test_it_reads_the_temperature_of_the_room(pty: bool) -> None:
    server = start_thermometer_server(ordinary_bench(3, Clock()), pty=pty)
    with Thermometer(server.url, TIMEOUT) as thermometer:
        celsius = thermometer.celsius()
    server.stop()
    assert celsius == pytest.approx(ordinary_bench(3, Clock()).temperature(0.0), abs=0.011)


def test_one_lost_answer_is_asked_for_again(thermometer: Thermometer, server: ThermometerServer) -> None:
    server.faults.set("silent", 1)
    assert 20 < thermometer.celsius() < 26


def test_a_thermometer_that_stays_silent_is_said_within_its_timeouts(
    thermometer: Thermometer, server: ThermometerServer
) -> None:
    server.faults.set("silent")
    with pytest.raises(ThermometerError, match="no answer; check its cable"):
        thermometer.celsius()


def test_answers_that_come_late_do_not_pile_up(thermometer: Thermometer, server: ThermometerServer) -> None:
    server.faults.set("slow", 1)
    assert 20 < thermometer.celsius() < 26
    time.sleep(0.3)  # the answer to the question asked again has come meanwhile
    server.faults.set("open_sensor", 1)
    with pytest.raises(ThermometerError, match="850 C"):
        thermometer.celsius()


def test_an_answer_that_is_no_temperature_is_shown(thermometer: Thermometer, server: ThermometerServer) -> None:
    server.faults.set("garbled", 1)
    with pytest.raises(ThermometerError, match="which is no temperature"):
        thermometer.celsius()
    assert 20 < thermometer.celsius() < 26


def test_a_temperature_that_cannot_be_is_refused(thermometer: Thermometer, server: ThermometerServer) -> None:
    server.faults.set("open_sensor")
    with pytest.raises(ThermometerError, match="850 C is outside 5 to 45 C; is its sensor open"):
        thermometer.celsius()


# pyserial does not close a socket whose other end is gone; the collector does, and says so
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_line_that_is_lost_is_said() -> None:
    server = start_thermometer_server(ordinary_bench(3, Clock()))
    with Thermometer(server.url, TIMEOUT) as thermometer:
        server.stop()
        with pytest.raises(ThermometerError, match=r"lost|no answer"):
            thermometer.celsius()
    gc.collect()


@pytest.mark.parametrize("url", ["/dev/there-is-no-such-line", "socket://127.0.0.1:1", "nonsense://x"])
def test_a_line_that_is_not_there_is_said(url: str) -> None:
    with pytest.raises(ThermometerError, match="cannot open the line"):
        Thermometer(url, TIMEOUT)


def test_a_serial_line_that_is_unplugged_is_said(server: ThermometerServer, thermometer: Thermometer) -> None:
    assert 20 < thermometer.celsius() < 26
    server.stop()
    with pytest.raises(ThermometerError, match="the line is lost"):
        thermometer.celsius()
