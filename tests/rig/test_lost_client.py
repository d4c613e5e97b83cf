"""The client is gone, whichever way: the actuator comes to rest within the watchdog time and one tick."""

import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from daq.device import connect as connect_daq
from rig.registers import Interlock, State
from rig.tester import driver as tester
from rig.tester.status import TesterTrippedError
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.daq_server import start_daq_server
from simlab.tester_device import DeviceLimits
from simlab.tester_server import TesterServer as Server
from simlab.tester_server import start_tester_server
from tests.fault_proxy import FaultProxy, Impairment, Way
from tests.waiting import LONG, until

WATCHDOG_TIME = 0.8  # s

CYCLING = """
import sys, time
from rig.tester.driver import connect
with connect(sys.argv[1], timeout=0.1) as driver:
    driver.start()
    driver.preset(5e-4)
    driver.cycle(1e-4, 50.0)
    print("cycling", flush=True)
    while True:
        driver.measured()
        time.sleep(0.01)
"""
ACQUIRING = """
import sys
from daq.channels import Channel, ChannelKind
from daq.device import connect
from daq.instrument import EdgeTrigger
channels = (Channel("hammer", "cDAQ1Mod1/ai0", ChannelKind.FORCE_IEPE, 2.25e-3, "N", -2000, 2000, 2e-3),)
trigger = EdgeTrigger("hammer", 5.0, 0.01)
with connect(sys.argv[1]) as chassis, chassis.triggered(channels, 5120.0, 0.1, trigger) as task:
    task.arm()
    print("armed", flush=True)
    task.wait(60.0)
"""


@contextmanager
def child(program: str, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """A process that runs `program` and has said its first word."""
    command = [sys.executable, "-c", program, *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() != ""
            yield process
        finally:
            process.kill()


@pytest.fixture
def server() -> Iterator[Server]:
    bench = ordinary_bench(11, Clock(speed=200.0))
    bench.mount("I", "shear")
    server = start_tester_server(bench, limits=DeviceLimits(watchdog_time=WATCHDOG_TIME))
    yield server
    server.stop()


def check_that_the_watchdog_stops(server: Server, lose: Callable[[], object]) -> None:
    assert server.actuator.steady_pp() > 0.0
    lose()
    until(lambda: server.actuator.steady_pp() == 0.0)
    status = server.device.status()
    assert status["state"] == State.TRIPPED
    assert status["interlocks"] == Interlock.WATCHDOG


def test_a_killed_client(server: Server) -> None:
    with child(CYCLING, server.url) as process:
        check_that_the_watchdog_stops(server, process.kill)
    with tester.connect(server.url, timeout=0.3) as driver:  # the next one finds out why, and goes on after a reset
        with pytest.raises(TesterTrippedError, match="watchdog"):
            driver.start()
        driver.reset()
        driver.start()


def test_a_client_that_was_stopped_and_finds_out_when_it_goes_on(server: Server) -> None:
    with child(CYCLING, server.url) as process:
        check_that_the_watchdog_stops(server, lambda: process.send_signal(signal.SIGSTOP))
        process.send_signal(signal.SIGCONT)
        _, said = process.communicate(timeout=LONG)
        # stopped between a request and its reply, it takes the line for lost and asks for the interlocks next
        assert "was stopped by watchdog" in said or "interlocks of SIM-ET-0001: watchdog" in said
        assert process.returncode == 1
    assert server.device.status()["interlocks"] == Interlock.WATCHDOG


@pytest.mark.parametrize("loss", ["reset", "black hole", "nothing arrives"])
def test_a_cut_cable(server: Server, loss: str) -> None:
    proxy = FaultProxy(server.url.removeprefix("tcp://"), seed=3)
    ways = {"black hole": Way.BOTH, "nothing arrives": Way.REQUESTS}
    try:
        with child(CYCLING, f"tcp://{proxy.address}") as process:
            cut = proxy.cut if loss == "reset" else lambda: proxy.impair(Impairment(lost=ways[loss]))
            check_that_the_watchdog_stops(server, cut)
            _, said = process.communicate(timeout=LONG)
            assert "not confirmed at rest" in said
    finally:
        proxy.stop()


def test_a_client_that_ends_as_it_should_trips_nothing(server: Server) -> None:
    with child(CYCLING, server.url) as process:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=LONG)
    status = server.device.status()
    assert (status["state"], status["interlocks"]) == (State.HYDRAULICS_OFF, Interlock(0))


def test_commands_of_a_killed_client_are_cleared_by_the_next() -> None:
    server = start_daq_server(ordinary_bench(11, Clock(speed=200.0)))
    try:
        with child(ACQUIRING, server.address) as process:
            process.kill()
        left_over = server.tasks
        assert len(left_over) == 1
        with child(ACQUIRING, server.address) as process:  # armed in its turn
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=LONG)
        assert not server.tasks
        with connect_daq(server.address) as chassis:
            assert len(chassis.devices) == 5
    finally:
        server.stop()
