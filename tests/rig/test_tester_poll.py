"""A look at the tester changes nothing at the instrument: neither its commands nor its watchdog notice."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import closing

import pytest

from rig.errors import RigError
from rig.modbus import ModbusLink
from rig.registers import COMMAND, HEARTBEAT, CommandCode, Interlock, State, Value
from rig.tester_poll import poll_tester
from simlab.bench import Bench
from simlab.clock import Clock
from simlab.tester_device import DeviceLimits
from simlab.tester_server import TesterFault, start_tester_server
from simlab.tester_server import TesterServer as Server

WATCHDOG_TIME = 0.4  # s


@pytest.fixture(params=[False, True], ids=["tcp", "rtu"])
def server(request: pytest.FixtureRequest) -> Iterator[Server]:
    server = start_tester_server(
        Bench(11, Clock(speed=200.0)), rtu=request.param, limits=DeviceLimits(watchdog_time=WATCHDOG_TIME)
    )
    yield server
    server.stop()


def switch_on(server: Server) -> None:
    """Hydraulics on, by a client that then sends no heartbeat."""
    values: dict[str, Value] = {"preset": 0.0, "amplitude": 0.0, "frequency": 0.0, "limit": 0.0}
    values |= {"detector": 0, "action": 0, "command": CommandCode.HYDRAULICS_ON, "sequence": 1}
    with closing(ModbusLink(server.url)) as link:
        link.write_holding(HEARTBEAT.address, HEARTBEAT.pack({"heartbeat": 7}))
        link.write_holding(COMMAND.address, COMMAND.pack(values))


def test_a_look_commands_nothing_and_says_what_the_tester_is_at(server: Server) -> None:
    found = poll_tester(server.url)
    assert (found.state, found.stopped_by) == (State.HYDRAULICS_OFF, Interlock(0))
    server.emergency_stop()
    assert poll_tester(server.url).stopped_by == Interlock.EMERGENCY_STOP
    assert not server.device.applied
    assert server.device.status()["sequence"] == server.device.status()["heartbeat"] == 0


def test_looking_all_the_time_keeps_no_watchdog_quiet(server: Server) -> None:
    switch_on(server)
    assert poll_tester(server.url).state is State.IDLE
    until = time.monotonic() + 50 * WATCHDOG_TIME
    while (found := poll_tester(server.url)).state is State.IDLE:
        assert time.monotonic() < until, "whoever reads keeps the watchdog quiet"
    assert found.stopped_by == Interlock.WATCHDOG
    assert server.device.status()["heartbeat"] == 7
    assert server.device.applied == [CommandCode.HYDRAULICS_ON]


@pytest.mark.parametrize("fault", [TesterFault.SILENT, TesterFault.FLIPPED_STATUS])
def test_an_answer_that_does_not_come_or_makes_no_sense_is_an_error(server: Server, fault: TesterFault) -> None:
    server.faults.set(fault)
    with pytest.raises(RigError, match=r"no reply|checksum"):  # a serial frame with a flipped bit is none
        poll_tester(server.url)
