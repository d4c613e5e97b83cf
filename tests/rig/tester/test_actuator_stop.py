"""A stop reaches each tester, also one that may not be driven: HOLD goes out before anything is read."""

from collections.abc import Iterator
from contextlib import closing
from functools import partial

import pytest
from pymodbus.constants import ExcCodes

from rig.errors import RigError
from rig.events import Event, InterlockTripped, RestSeen, RestUnknown
from rig.registers import CommandCode, Interlock, Refusal, State
from rig.tester import driver as tester
from rig.tester.actuator_stop import stop_tester
from rig.tester.modbus import ModbusLink
from rig.tester.register_map import OURS, TesterMap
from rig.tester.status import ActuatorNotAtRestError, TesterMismatchError
from rig.tester.wire import TesterWire
from simlab.tester_server import TesterFault, TesterServer
from tests.fault_proxy import FaultProxy, Impairment
from tests.rig.mapped import MappedLaboratory, bare_map, example_map, mapped_laboratory
from tests.waiting import until


def _is_held(wire: TesterWire) -> bool:
    return wire.status().state is State.HELD


def cycled_by_another_client(laboratory: MappedLaboratory) -> TesterServer:
    """The tester, which cycles; the client that began it has gone, and the watchdog does not act."""
    laboratory.bench.mount("I", "shear")
    laboratory.tester.faults.set(TesterFault.DEAD_WATCHDOG)
    with closing(ModbusLink(laboratory.tester.url)) as link:
        wire = TesterWire(link, laboratory.tester_map)
        wire.join()
        wire.command(CommandCode.HYDRAULICS_ON)
        wire.command(CommandCode.PRESET, preset=5e-4)
        until(lambda: wire.status().state is State.HELD)
        wire.command(CommandCode.CYCLE, amplitude=1e-4, frequency=20.0)
    until(laboratory.moves)
    return laboratory.tester


@pytest.fixture(params=[False, True], ids=["tcp", "rtu"])
def cycling(request: pytest.FixtureRequest) -> Iterator[TesterServer]:
    with mapped_laboratory(OURS, rtu=request.param) as laboratory:
        yield cycled_by_another_client(laboratory)


@pytest.mark.parametrize(
    "fault",
    [TesterFault.MILD_DETECTOR, TesterFault.NO_WATCHDOG, TesterFault.NO_LIMITS, TesterFault.WRONG_UNITS, "DETECTORS"],
)
def test_a_tester_that_may_not_be_driven_is_stopped(cycling: TesterServer, fault: str) -> None:
    if fault == "DETECTORS":
        cycling.script.set(fault, ExcCodes.DEVICE_FAILURE)
    else:
        cycling.faults.set(fault)
    with pytest.raises(RigError), tester.connect(cycling.url):
        pass
    events = list[Event]()
    stop_tester(cycling.url, OURS, events.append)
    assert cycling.device.status()["state"] == State.HYDRAULICS_OFF
    assert cycling.actuator.steady_pp() == 0.0
    assert events == [RestSeen()]


def test_hold_goes_out_before_anything_is_read(cycling: TesterServer) -> None:
    before = len(cycling.device.applied)
    for block in ("IDENTITY", "DETECTORS", "STATUS"):
        cycling.script.set(block, ExcCodes.DEVICE_FAILURE)
    events = list[Event]()
    with pytest.raises(ActuatorNotAtRestError, match=r"press the red button$"):
        stop_tester(cycling.url, OURS, events.append)
    assert cycling.device.applied[before] is CommandCode.HOLD
    assert cycling.actuator.steady_pp() == 0.0
    assert [type(event) for event in events] == [RestUnknown]


def test_a_hold_is_obeyed_and_confirmed_whatever_the_number_of_the_command_in_force(cycling: TesterServer) -> None:
    """With 0x7FFF or more in force, the number of the first hold counts as newer; below it counts as behind."""
    stop_tester(cycling.url, OURS, lambda event: None)
    for number in (0x7FFE, 0xFFFD):
        with closing(ModbusLink(cycling.url)) as link:
            wire = TesterWire(link)
            wire.join()
            wire._sequence = number - 1
            wire.command(CommandCode.HYDRAULICS_ON)
            wire.command(CommandCode.PRESET, preset=5e-4)
            until(partial(_is_held, wire))
            wire.command(CommandCode.CYCLE, amplitude=1e-4, frequency=20.0)
        events = list[Event]()
        stop_tester(cycling.url, OURS, events.append)
        assert events == [RestSeen()]  # by HOLD, and not by the coil
        assert cycling.actuator.steady_pp() == 0.0


def test_a_hold_that_is_refused_becomes_an_emergency_stop(cycling: TesterServer) -> None:
    cycling.script.set("HOLD", Refusal.FAULT)
    events = list[Event]()
    stop_tester(cycling.url, OURS, events.append)
    assert cycling.actuator.steady_pp() == 0.0
    assert events == [InterlockTripped(Interlock.EMERGENCY_STOP, stopped=True), RestSeen()]


@pytest.mark.parametrize("cycling", [False], ids=["tcp"], indirect=True)
def test_replies_that_come_too_late_do_not_delay_the_hold(cycling: TesterServer) -> None:
    proxy = FaultProxy(cycling.url.removeprefix("tcp://"))
    try:
        proxy.impair(Impairment(latency=0.1))  # each way
        before = len(cycling.device.applied)
        with pytest.raises(ActuatorNotAtRestError):
            stop_tester(f"tcp://{proxy.address}", OURS, lambda event: None)
    finally:
        proxy.stop()
    assert cycling.device.applied[before] is CommandCode.HOLD
    assert cycling.actuator.steady_pp() == 0.0


@pytest.mark.parametrize("tester_map", [example_map(), example_map(watchdog=False), bare_map()])
def test_a_tester_with_other_registers_is_stopped_also_where_nobody_has_accepted_what_it_lacks(
    tester_map: TesterMap,
) -> None:
    with mapped_laboratory(tester_map) as laboratory:
        server = cycled_by_another_client(laboratory)
        if tester_map.heartbeat is None:
            with pytest.raises(TesterMismatchError), tester.connect(server.url, tester_map=tester_map):
                pass
        server.faults.set("other_type")
        before = len(server.device.applied)
        stop_tester(server.url, tester_map, laboratory.events.append)
        assert server.actuator.steady_pp() == 0.0
        assert server.device.status()["state"] == State.HYDRAULICS_OFF
        assert server.device.applied[before] is CommandCode.HOLD
        assert laboratory.events == [RestSeen()]
