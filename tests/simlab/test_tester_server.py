"""The simulated tester as its wire shows it, without our driver: its own limits, interlocks and watchdog hold."""

import time
from collections.abc import Iterator
from typing import TypeAlias

import pytest
from pymodbus.client import ModbusTcpClient
from pymodbus.constants import ExcCodes
from pymodbus.pdu import ExceptionResponse

from rig.registers import (
    COMMAND,
    DETECTORS,
    EMERGENCY_STOP_COIL,
    HEARTBEAT,
    IDENTITY,
    STATUS,
    Action,
    CommandCode,
    Interlock,
    Refusal,
    State,
    Value,
)
from simlab import tester_server
from simlab.bench import SimulatedBench, ordinary_bench
from simlab.clock import Clock
from simlab.tester_device import DeviceLimits
from tests.waiting import LONG

WATCHDOG_TIME = 0.4
Server: TypeAlias = tester_server.TesterServer  # a name that pytest does not take for a test


class Wire:
    """A bare Modbus client on the tester's registers: it checks nothing."""

    def __init__(self, server: Server) -> None:
        host, port = server.url.removeprefix("tcp://").split(":")
        self.client = ModbusTcpClient(host, port=int(port), timeout=LONG, retries=0)
        self.sequence = 0

    def command(
        self,
        code: int,
        preset: float = 0.0,
        amplitude: float = 0.0,
        frequency: float = 0.0,
        sequence: int | None = None,
        detector: int = 0,
        action: int = 0,
        limit: float = 0.0,
        flip: int | None = None,
    ) -> ExcCodes | None:
        """Send one command; the exception code, or None where it was accepted."""
        self.sequence += 1
        words = COMMAND.pack(
            {
                "command": code,
                "sequence": self.sequence if sequence is None else sequence,
                "preset": preset,
                "amplitude": amplitude,
                "frequency": frequency,
                "detector": detector,
                "action": action,
                "limit": limit,
            }
        )
        if flip is not None:
            words[flip] ^= 4
        reply = self.client.write_registers(COMMAND.address, words, device_id=1)
        return ExcCodes(reply.exception_code) if isinstance(reply, ExceptionResponse) else None

    def close(self) -> None:
        self.client.close()  # type: ignore[no-untyped-call]  # pymodbus leaves it without types

    def beat(self, count: int) -> None:
        words = HEARTBEAT.pack({"heartbeat": count})
        assert not self.client.write_registers(HEARTBEAT.address, words, device_id=1).isError()

    def status(self) -> dict[str, Value]:
        reply = self.client.read_input_registers(STATUS.address, count=STATUS.count, device_id=1)
        return STATUS.unpack(reply.registers)

    def until(self, state: State, within: float = LONG) -> None:
        end = time.monotonic() + within
        while self.status()["state"] != state:
            assert time.monotonic() < end, f"still {self.status()}"
            time.sleep(0.002)

    def start(self, preset: float = 5e-4) -> None:
        assert self.command(CommandCode.HYDRAULICS_ON) is None
        assert self.command(CommandCode.PRESET, preset=preset) is None
        self.until(State.HELD)


@pytest.fixture
def bench() -> SimulatedBench:
    bench = ordinary_bench(7, Clock(speed=100.0))
    bench.mount("I", "shear")
    return bench


@pytest.fixture
def server(bench: SimulatedBench) -> Iterator[Server]:
    server = tester_server.start_tester_server(bench, limits=DeviceLimits(watchdog_time=WATCHDOG_TIME))
    yield server
    server.stop()


@pytest.fixture
def wire(server: Server) -> Iterator[Wire]:
    wire = Wire(server)
    yield wire
    wire.close()


@pytest.fixture
def slow_wire() -> Iterator[Wire]:
    """A tester on the wall's time, where no state is over before it can be read."""
    bench = ordinary_bench(7, Clock())
    bench.mount("I", "shear")
    server = tester_server.start_tester_server(bench)
    wire = Wire(server)
    yield wire
    wire.close()
    server.stop()


def test_it_says_who_it_is_and_which_limits_live_in_it(wire: Wire) -> None:
    reply = wire.client.read_input_registers(IDENTITY.address, count=IDENTITY.count, device_id=1)
    identity = IDENTITY.unpack(reply.registers)
    assert (identity["map_version"], identity["units"], identity["serial"]) == (2, 1, "SIM-ET-0001")
    assert identity["watchdog_time"] == pytest.approx(WATCHDOG_TIME)
    assert identity["frequency_limit"] == 250.0
    reply = wire.client.read_input_registers(DETECTORS.address, count=DETECTORS.count, device_id=1)
    detectors = DETECTORS.unpack(reply.registers)
    assert (detectors["force_limit"], detectors["force_action"]) == (5000.0, Action.PROGRAM_INTERLOCK)
    assert (detectors["underpeak_limit"], detectors["underpeak_action"]) == (0.5, Action.INDICATE)


def test_it_goes_through_its_states_from_off_to_settled_and_back(slow_wire: Wire) -> None:
    wire = slow_wire
    assert wire.status()["state"] == State.HYDRAULICS_OFF
    wire.command(CommandCode.HYDRAULICS_ON)
    assert wire.status()["state"] == State.IDLE
    wire.command(CommandCode.PRESET, preset=5e-4)
    assert wire.status()["state"] == State.RAMPING
    wire.until(State.HELD)
    wire.command(CommandCode.CYCLE, amplitude=1e-4, frequency=50.0)
    assert wire.status()["state"] == State.CYCLING
    wire.until(State.SETTLED)
    status = wire.status()
    assert status["cycles"] >= 1  # type: ignore[operator]  # one of several types
    assert status["displacement_mean"] == pytest.approx(5e-4)
    wire.command(CommandCode.HOLD)
    wire.until(State.HELD)
    wire.command(CommandCode.HYDRAULICS_OFF)
    assert wire.status()["state"] == State.HYDRAULICS_OFF


@pytest.mark.parametrize(
    ("amplitude", "frequency", "refusal"),
    [
        (6e-4, 10.0, Refusal.AMPLITUDE_LIMIT),
        (-1e-4, 10.0, Refusal.AMPLITUDE_LIMIT),
        (float("nan"), 10.0, Refusal.AMPLITUDE_LIMIT),
        (1e-4, 251.0, Refusal.FREQUENCY_LIMIT),
        (1e-4, float("nan"), Refusal.FREQUENCY_LIMIT),
        (4e-4, 200.0, Refusal.VELOCITY_LIMIT),
        (2.4e-4, 240.0, Refusal.ACCELERATION_LIMIT),
    ],
)
def test_a_cycle_beyond_its_limits_is_refused(
    wire: Wire, server: Server, amplitude: float, frequency: float, refusal: Refusal
) -> None:
    wire.start()
    assert wire.command(CommandCode.CYCLE, amplitude=amplitude, frequency=frequency) is ExcCodes.ILLEGAL_VALUE
    assert wire.status()["refusal"] == refusal
    assert wire.status()["state"] == State.HELD
    assert CommandCode.CYCLE not in server.device.applied


def test_a_preset_beyond_the_displacement_limit_is_refused(wire: Wire) -> None:
    wire.command(CommandCode.HYDRAULICS_ON)
    assert wire.command(CommandCode.PRESET, preset=1.6e-3) is ExcCodes.ILLEGAL_VALUE
    assert wire.status()["refusal"] == Refusal.PRESET_LIMIT


def test_a_cycle_that_would_pass_the_displacement_limit_from_its_preset_is_refused(wire: Wire) -> None:
    wire.start(preset=1.4e-3)
    assert wire.command(CommandCode.CYCLE, amplitude=3e-4, frequency=10.0) is ExcCodes.ILLEGAL_VALUE
    assert wire.status()["refusal"] == Refusal.DISPLACEMENT_LIMIT


def test_cycling_before_the_preset_is_reached_is_refused(wire: Wire) -> None:
    wire.command(CommandCode.HYDRAULICS_ON)
    wire.command(CommandCode.PRESET, preset=1.4e-3)
    assert wire.command(CommandCode.CYCLE, amplitude=1e-4, frequency=10.0) is ExcCodes.DEVICE_FAILURE
    assert wire.status()["refusal"] == Refusal.NOT_AT_PRESET


def test_nothing_moves_with_hydraulics_off(wire: Wire) -> None:
    assert wire.command(CommandCode.PRESET, preset=5e-4) is ExcCodes.DEVICE_FAILURE
    assert wire.status()["refusal"] == Refusal.HYDRAULICS_ARE_OFF


def test_a_command_with_a_flipped_bit_is_refused_and_changes_nothing(wire: Wire, server: Server) -> None:
    for word in range(COMMAND.count):
        assert wire.command(CommandCode.HYDRAULICS_ON, flip=word) is ExcCodes.ILLEGAL_VALUE
        assert wire.status()["refusal"] == Refusal.CHECKSUM
    assert server.device.applied == []


def test_the_same_command_twice_is_acknowledged_and_applied_once(wire: Wire, server: Server) -> None:
    assert wire.command(CommandCode.HYDRAULICS_ON, sequence=5) is None
    assert wire.command(CommandCode.HYDRAULICS_ON, sequence=5) is None
    assert server.device.applied == [CommandCode.HYDRAULICS_ON]


def test_another_command_under_a_used_sequence_number_is_refused(wire: Wire) -> None:
    wire.command(CommandCode.HYDRAULICS_ON, sequence=5)
    assert wire.command(CommandCode.PRESET, preset=5e-4, sequence=5) is ExcCodes.ILLEGAL_VALUE
    assert wire.status()["refusal"] == Refusal.STALE_SEQUENCE


def test_a_command_that_was_delayed_beyond_a_newer_one_is_refused(wire: Wire, server: Server) -> None:
    wire.start()
    wire.command(CommandCode.HOLD, sequence=30_000)
    wire.command(CommandCode.HOLD, sequence=60_000)
    assert wire.command(CommandCode.CYCLE, amplitude=1e-4, frequency=50.0, sequence=59_999) is ExcCodes.ILLEGAL_VALUE
    assert wire.status()["refusal"] == Refusal.STALE_SEQUENCE
    assert wire.command(CommandCode.HOLD, sequence=1) is None  # the numbers have started again
    assert CommandCode.CYCLE not in server.device.applied


@pytest.mark.parametrize("stop", [CommandCode.HOLD, CommandCode.HYDRAULICS_OFF])
def test_a_stop_is_not_refused_whatever_its_number(stop: CommandCode, wire: Wire, server: Server) -> None:
    wire.start()
    wire.command(CommandCode.PRESET, preset=1e-4, sequence=30_000)
    assert wire.command(stop, sequence=29_999) is None
    assert server.device.applied[-1] is stop
    assert wire.command(CommandCode.HYDRAULICS_ON, sequence=29_999) is ExcCodes.ILLEGAL_VALUE  # still behind
    assert wire.status()["refusal"] == Refusal.STALE_SEQUENCE


def test_an_unknown_command_is_refused(wire: Wire) -> None:
    assert wire.command(99) is ExcCodes.ILLEGAL_VALUE
    assert wire.status()["refusal"] == Refusal.UNKNOWN_COMMAND


def test_part_of_a_command_cannot_be_written(wire: Wire) -> None:
    reply = wire.client.write_register(COMMAND.address_of("amplitude"), 1, device_id=1)
    assert isinstance(reply, ExceptionResponse)
    assert reply.exception_code == ExcCodes.ILLEGAL_ADDRESS


def test_limits_cannot_be_written(wire: Wire) -> None:
    reply = wire.client.write_registers(IDENTITY.address, [0] * 4, device_id=1)
    assert isinstance(reply, ExceptionResponse)


def test_the_watchdog_stops_the_actuator_in_wall_time_when_beats_stay_away(
    wire: Wire, server: Server, bench: SimulatedBench
) -> None:
    wire.start()
    wire.command(CommandCode.CYCLE, amplitude=1e-4, frequency=50.0)
    wire.beat(1)
    last_beat = time.monotonic()
    wire.close()  # the client is gone
    while server.actuator.steady_pp() > 0 and time.monotonic() < last_beat + LONG:
        time.sleep(0.001)
    assert time.monotonic() - last_beat > WATCHDOG_TIME - 0.01
    status = wire.status()
    assert status["state"] == State.TRIPPED
    assert status["interlocks"] == Interlock.WATCHDOG
    assert server.actuator.amplitude_pp(bench.clock.now() + 1.0) < 1e-7
    rest = server.actuator.rests_since(1e-7)
    assert rest is not None
    moved_on = bench.clock.monotonic(rest) - last_beat
    assert WATCHDOG_TIME - 0.1 < server.device.longest_unheard < moved_on + 0.1  # the last look was before the rest


def test_a_beat_that_does_not_count_on_is_no_beat(wire: Wire) -> None:
    wire.start()
    end = time.monotonic() + 2 * WATCHDOG_TIME
    while time.monotonic() < end:
        wire.beat(1)
        time.sleep(0.02)
    assert wire.status()["interlocks"] == Interlock.WATCHDOG


def test_beats_keep_the_watchdog_quiet(wire: Wire) -> None:
    wire.start()
    for count in range(1, 21):
        wire.beat(count)
        time.sleep(0.05)
    assert wire.status()["state"] == State.HELD


def test_the_emergency_stop_stops_and_needs_release_and_reset(wire: Wire, server: Server) -> None:
    wire.start()
    wire.command(CommandCode.CYCLE, amplitude=1e-4, frequency=50.0)
    server.emergency_stop()
    assert wire.status()["interlocks"] == Interlock.EMERGENCY_STOP
    assert server.actuator.steady_pp() == 0.0
    assert wire.command(CommandCode.HYDRAULICS_ON) is ExcCodes.DEVICE_FAILURE
    assert wire.command(CommandCode.RESET) is ExcCodes.DEVICE_FAILURE
    assert wire.status()["refusal"] == Refusal.CAUSE_STILL_PRESENT
    server.release_emergency_stop()
    assert wire.status()["state"] == State.TRIPPED
    assert wire.command(CommandCode.RESET) is None
    assert wire.status()["state"] == State.HYDRAULICS_OFF


def test_the_emergency_stop_coil_trips_and_cannot_be_written_off(wire: Wire) -> None:
    wire.start()
    assert not wire.client.write_coil(EMERGENCY_STOP_COIL, True, device_id=1).isError()
    assert wire.status()["interlocks"] == Interlock.EMERGENCY_STOP
    assert wire.client.write_coil(EMERGENCY_STOP_COIL, False, device_id=1).isError()


def test_stops_are_accepted_while_tripped(wire: Wire, server: Server) -> None:
    server.emergency_stop()
    assert wire.command(CommandCode.HOLD) is None
    assert wire.command(CommandCode.HYDRAULICS_OFF) is None


def test_too_much_force_stops_the_program_and_resets_only_after_unloading(bench: SimulatedBench) -> None:
    server = tester_server.start_tester_server(bench, limits=DeviceLimits(force_limit=float(bench.static_force(4e-4))))
    wire = Wire(server)
    try:
        wire.command(CommandCode.HYDRAULICS_ON)
        wire.command(CommandCode.PRESET, preset=8e-4)
        wire.until(State.TRIPPED)
        assert wire.status()["interlocks"] == Interlock.FORCE
        assert wire.command(CommandCode.RESET) is ExcCodes.DEVICE_FAILURE
        wire.command(CommandCode.HYDRAULICS_OFF)
        time.sleep(0.05)  # 5 s on the bench
        assert wire.command(CommandCode.RESET) is None
    finally:
        wire.close()
        server.stop()


@pytest.mark.parametrize(
    ("fault", "state", "interlock"),
    [("runaway_servo", State.TRIPPED, Interlock.ERROR), ("weak_servo", State.SETTLED, Interlock.UNDERPEAK)],
)
def test_a_servo_that_overshoots_trips_and_a_weak_one_is_indicated(
    wire: Wire, server: Server, fault: str, state: State, interlock: Interlock
) -> None:
    wire.start()
    server.faults.set(fault)
    wire.command(CommandCode.CYCLE, amplitude=1e-4, frequency=50.0)
    wire.until(state)
    assert wire.status()["interlocks"] == interlock
    assert (server.actuator.steady_pp() == 0.0) is (state is State.TRIPPED)


def test_an_unknown_fault_is_refused_with_those_that_exist(server: Server) -> None:
    with pytest.raises(ValueError, match=r"no fault 'gremlins'.*busy"):
        server.faults.set("gremlins")


def test_a_port_in_use_is_said(server: Server) -> None:
    port = int(server.url.rpartition(":")[2])
    with pytest.raises(RuntimeError, match="did not start"):
        tester_server.start_tester_server(ordinary_bench(7, Clock(1.0)), port=port)
