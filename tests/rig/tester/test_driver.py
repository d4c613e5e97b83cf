"""The tester's driver against the simulated tester on real wires: Modbus TCP and Modbus RTU."""

import os
import threading
import time
from collections.abc import Iterator
from typing import TypeAlias
from urllib.parse import urlsplit

import pytest
from pymodbus.constants import ExcCodes

from rig.errors import RigError
from rig.events import Event, RestUnknown, TesterLineLost
from rig.registers import COMMAND, CommandCode, Interlock, Refusal, State, float32
from rig.tester import driver as tester
from rig.tester import limits as tester_limits
from rig.tester import modbus
from rig.tester import status as tester_status
from rig.tester.monitor import monitored
from simlab import tester_server
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.tester_device import DeviceLimits
from tests.ports import free_port
from tests.waiting import until

# names that pytest does not take for tests
Server: TypeAlias = tester_server.TesterServer
Limits: TypeAlias = tester_limits.TesterLimits

TIMEOUT = 0.15  # s, of one reply
WATCHDOG_TIME = 1.0


def serve(rtu: bool = False, limits: DeviceLimits | None = None) -> Server:
    bench = ordinary_bench(11, Clock(speed=200.0))
    bench.mount("I", "shear")
    return tester_server.start_tester_server(bench, rtu=rtu, limits=limits or DeviceLimits(watchdog_time=WATCHDOG_TIME))


@pytest.fixture
def server() -> Iterator[Server]:
    server = serve()
    yield server
    server.stop()


@pytest.fixture(params=["tcp", "rtu"])
def either(request: pytest.FixtureRequest) -> Iterator[Server]:
    server = serve(rtu=request.param == "rtu")
    yield server
    server.stop()


def set_cycling(driver: tester.Tester) -> None:
    driver.start()
    driver.preset(5e-4)
    driver.cycle(1e-4, 50.0)


def at_rest(server: Server) -> bool:
    return server.actuator.steady_pp() == 0.0


def test_a_day_at_the_tester_start_preset_cycle_stop(either: Server) -> None:
    with tester.connect(either.url, timeout=TIMEOUT) as driver:
        assert driver.identity.serial == "SIM-ET-0001"
        assert driver.status().state is State.HYDRAULICS_OFF
        set_cycling(driver)
        status = driver.wait(lambda status: status.state is State.SETTLED and status.cycles > 20, "settle")
        assert status.displacement_mean == pytest.approx(5e-4)
        assert (status.amplitude_pp, status.frequency) == (float32(1e-4), 50.0)
        assert len(status.displacement_pp) == 16
        assert status.displacement_pp[0] == pytest.approx(either.actuator.steady_pp(), rel=0.02)
        assert status.force_pp == pytest.approx(2 * 5e-5 * 7e5, rel=0.5)
        driver.stop()
        assert driver.status().state is State.HELD
    assert either.device.status()["state"] == State.HYDRAULICS_OFF
    assert either.device.applied == [
        CommandCode.HYDRAULICS_ON,
        CommandCode.PRESET,
        CommandCode.CYCLE,
        CommandCode.HOLD,
        CommandCode.HOLD,
        CommandCode.HYDRAULICS_OFF,
    ]


@pytest.mark.parametrize("fault", ["lost_reply", "flipped_command"])
def test_a_command_that_is_sent_again_is_applied_once(either: Server, fault: str) -> None:
    with tester.connect(either.url, timeout=TIMEOUT) as driver:
        driver.start()
        driver.preset(5e-4)
        either.faults.set(fault, 1)
        driver.cycle(1e-4, 50.0)
        assert driver.measured().amplitude_pp == float32(1e-4)
    assert either.device.applied.count(CommandCode.CYCLE) == 1


def test_a_flipped_bit_in_a_status_does_not_pass_and_the_status_is_read_again(either: Server) -> None:
    with tester.connect(either.url, timeout=TIMEOUT) as driver:
        either.faults.set("flipped_status", 2)
        assert driver.status() == driver.status()


def test_a_status_that_stays_garbled_is_an_error_that_says_so(server: Server) -> None:
    with tester.connect(server.url, timeout=TIMEOUT) as driver:
        server.faults.set("flipped_status")
        with pytest.raises(modbus.ModbusProtocolError, match="STATUS came with checksum"):
            driver.status()
        server.faults.clear()


def test_a_dropped_connection_is_made_again(server: Server) -> None:
    with tester.connect(server.url, timeout=TIMEOUT) as driver:
        driver.start()
        for _ in range(5):
            server.faults.set("drop", 1)
            driver.preset(4e-4)
        assert driver.status().state is State.HELD


def test_a_busy_tester_is_asked_again(server: Server) -> None:
    with tester.connect(server.url, timeout=TIMEOUT) as driver:
        server.faults.set("busy", 2)
        driver.start()
        assert driver.status().state is State.IDLE


def test_a_tester_that_stays_busy_is_refused_with_its_words(server: Server) -> None:
    with tester.connect(server.url, timeout=TIMEOUT) as driver:
        server.faults.set("busy")
        with pytest.raises(tester_status.TesterRefusedError, match="refused hydraulics_on: busy"):
            driver.start()
        server.faults.clear()


def test_a_tester_that_refuses_everything_is_brought_to_rest_by_its_emergency_stop(server: Server) -> None:
    def work() -> None:
        with tester.connect(server.url, timeout=TIMEOUT) as driver:
            set_cycling(driver)
            server.faults.set("refuse")
            driver.cycle(1e-4, 60.0)

    with pytest.raises(tester_status.TesterRefusedError, match=r"refused cycle: .*cannot do that now"):
        work()
    assert at_rest(server)
    assert server.device.status()["interlocks"] == Interlock.EMERGENCY_STOP


def test_the_tester_is_at_rest_after_any_error(server: Server) -> None:
    def work() -> None:
        with tester.connect(server.url, timeout=TIMEOUT) as driver:
            set_cycling(driver)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        work()
    assert at_rest(server)
    assert server.device.status()["state"] == State.HYDRAULICS_OFF


def test_a_cut_cable_is_reported_as_rest_not_confirmed_and_the_watchdog_stops_the_actuator(either: Server) -> None:
    def work() -> None:
        with tester.connect(either.url, timeout=0.05) as driver:
            set_cycling(driver)
            either.faults.set("cut")

    with pytest.raises(tester_status.ActuatorNotAtRestError, match=r"not confirmed at rest.*should stop it within 1 s"):
        work()
    until(lambda: at_rest(either))
    assert either.device.status()["interlocks"] == Interlock.WATCHDOG


def test_a_serial_line_that_is_unplugged_while_it_cycles_is_a_lost_line() -> None:
    server, events = serve(rtu=True), list[Event]()
    # kept open, so that no other program gets a pseudo-terminal of this name, which the driver would open
    other_end = os.open(urlsplit(server.url).path, os.O_RDWR | os.O_NOCTTY)

    def work() -> None:
        with tester.connect(server.url, timeout=TIMEOUT, observer=events.append) as driver, monitored(driver):
            set_cycling(driver)
            server.stop()
            driver.wait(lambda _: False, "lose its line", timeout=30.0)

    with pytest.raises(tester_status.LineLostError, match=r"line lost .*no connection.*should stop it within 1 s"):
        work()
    os.close(other_end)
    assert events[0] == TesterLineLost(WATCHDOG_TIME)
    assert [type(each) for each in events[1:]] == [RestUnknown]


def test_an_error_inside_comes_out_with_a_note_that_rest_was_not_confirmed(server: Server) -> None:
    def work() -> None:
        with tester.connect(server.url, timeout=0.05) as driver:
            set_cycling(driver)
            server.faults.set("cut")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError) as raised:
        work()
    assert "not confirmed at rest" in raised.value.__notes__[0]


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("wrong_map_version", "register map version 3, this driver knows 2"),
        ("wrong_units", "units code 2, not in SI"),
        ("no_watchdog", "watchdog off"),
        ("no_limits", "has no velocity_limit, force_limit"),
        ("mild_detector", "only indicates force"),
    ],
)
def test_a_tester_that_is_not_as_it_should_be_is_not_driven(either: Server, fault: str, words: str) -> None:
    either.faults.set(fault)
    with pytest.raises(tester_status.TesterMismatchError, match=words), tester.connect(either.url, timeout=TIMEOUT):
        pytest.fail("connected")
    assert either.device.applied == []


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        (DeviceLimits(watchdog_time=1e6), "watchdog time 1e[+]06, outside 0.1 to 10 s"),
        (DeviceLimits(amplitude_limit=1e3), "amplitude limit 1000, outside 1e-06 to 0.01 m"),
        (DeviceLimits(force_limit=1e30), "force limit 1e[+]30, outside 1 to 25000 N"),
    ],
)
def test_limits_that_limit_nothing_are_refused(limits: DeviceLimits, words: str) -> None:
    server = tester_server.start_tester_server(ordinary_bench(7, Clock(100.0)), limits=limits)
    try:
        with pytest.raises(tester_status.TesterMismatchError, match=words), tester.connect(server.url, timeout=TIMEOUT):
            pytest.fail("connected")
        assert server.device.applied == []
    finally:
        server.stop()


def test_an_absent_tester_is_said_within_the_timeouts() -> None:
    port = free_port()
    with (
        pytest.raises(modbus.ModbusUnreachableError, match=f"127.0.0.1:{port}: no connection"),
        tester.connect(f"tcp://127.0.0.1:{port}", timeout=0.2),
    ):
        pytest.fail("connected")


@pytest.mark.parametrize(
    "url", ["127.0.0.1:502", "tcp://", "rtu://", "http://x", "tcp://host:port", "rtu:///dev/x?baudrate=fast"]
)
def test_an_address_of_another_form_is_refused_with_the_two_forms_there_are(url: str) -> None:
    with pytest.raises(RigError, match="is no address of a tester"):
        modbus.ModbusLink(url)


@pytest.mark.parametrize(
    ("amplitude_pp", "frequency", "words"),
    [
        (3.1e-4, 10.0, "amplitude 0.31 mm is outside"),
        (float("nan"), 10.0, "amplitude nan m"),
        (1e-4, 0.5, "frequency 0.5 Hz"),
        (1e-4, 251.0, "frequency 251 Hz"),
        (2.9e-4, 180.0, "velocity 0.16"),
        (2.2e-4, 200.0, "acceleration 173"),
    ],
)
def test_a_cycle_beyond_the_rigs_limits_is_not_sent(
    server: Server, amplitude_pp: float, frequency: float, words: str
) -> None:
    with tester.connect(server.url, timeout=TIMEOUT) as driver:
        driver.start()
        driver.preset(5e-4)
        with pytest.raises(tester_limits.LimitExceededError, match=words):
            driver.cycle(amplitude_pp, frequency)
        assert driver.status().state is State.HELD
    assert CommandCode.CYCLE not in server.device.applied


@pytest.mark.parametrize("position", [1.01e-3, -1e-5, float("nan")])
def test_a_preset_beyond_the_rigs_limits_is_not_sent(server: Server, position: float) -> None:
    with tester.connect(server.url, timeout=TIMEOUT) as driver:
        driver.start()
        with pytest.raises(tester_limits.LimitExceededError, match="preset"):
            driver.preset(position)
    assert CommandCode.PRESET not in server.device.applied


def test_the_instruments_own_limit_holds_where_the_rigs_is_wider(server: Server) -> None:
    with tester.connect(server.url, Limits(amplitude_pp=1e-3), timeout=TIMEOUT) as driver:
        driver.start()
        driver.preset(5e-4)
        with pytest.raises(tester_status.TesterRefusedError, match="refused cycle: amplitude limit") as refused:
            driver.cycle(6e-4, 10.0)
        assert refused.value.refusal is Refusal.AMPLITUDE_LIMIT
        assert driver.measured().state is State.HELD


@pytest.mark.parametrize("frequency", [5.0, 60.0, 100.0, 200.0, 250.0])
def test_the_largest_amplitude_of_the_limits_passes_them_and_no_more_does(frequency: float) -> None:
    limits = Limits()
    largest = limits.largest_amplitude_pp(frequency)
    limits.check_cycle(largest, frequency)
    with pytest.raises(tester_limits.LimitExceededError):
        limits.check_cycle(largest * 1.001, frequency)


def test_the_emergency_stop_interrupts_and_only_a_reset_clears_it(server: Server) -> None:
    with tester.connect(server.url, timeout=TIMEOUT) as driver:
        set_cycling(driver)
        server.emergency_stop()
        with pytest.raises(tester_status.TesterTrippedError, match="stopped by emergency stop"):
            driver.measured()
        with pytest.raises(tester_status.TesterTrippedError):
            driver.start()
        with pytest.raises(tester_status.TesterRefusedError, match="cause still present"):
            driver.reset()
        server.release_emergency_stop()
        driver.reset()
        driver.start()
        assert driver.status().state is State.IDLE


def test_the_emergency_stop_of_the_driver_stops_the_actuator_at_once(server: Server) -> None:
    with tester.connect(server.url, timeout=TIMEOUT) as driver:
        set_cycling(driver)
        driver.emergency_stop()
        assert at_rest(server)
        assert driver.status().interlocks is Interlock.EMERGENCY_STOP


@pytest.mark.parametrize("code", [ExcCodes.DEVICE_BUSY, ExcCodes.ILLEGAL_ADDRESS], ids=lambda code: code.name)
def test_an_emergency_stop_that_is_refused_once_is_sent_again(server: Server, code: ExcCodes) -> None:
    with tester.connect(server.url, timeout=TIMEOUT) as driver:
        set_cycling(driver)
        server.script.set("HOLD", Refusal.FAULT)
        server.script.set("EMERGENCY_STOP", code, times=1)
        driver.halt()
        assert at_rest(server)
        assert server.device.status()["interlocks"] == Interlock.EMERGENCY_STOP


def test_a_wait_ends_when_the_tester_trips(server: Server) -> None:
    with tester.connect(server.url, timeout=TIMEOUT) as driver:
        driver.start()
        threading.Timer(0.1, server.emergency_stop).start()
        with pytest.raises(tester_status.TesterTrippedError):
            driver.wait(lambda _: False, "see the sun rise", timeout=5.0)


def test_a_wait_that_takes_too_long_says_what_for(server: Server) -> None:
    with (
        tester.connect(server.url, timeout=TIMEOUT) as driver,
        pytest.raises(RigError, match=r"the tester did not see the sun rise within 0\.05 s, it is hydraulics off"),
    ):
        driver.wait(lambda _: False, "see the sun rise", timeout=0.05)


def test_another_client_that_commands_in_between_is_noticed(server: Server) -> None:
    with tester.connect(server.url, timeout=TIMEOUT) as driver:
        set_cycling(driver)
        intruder = modbus.ModbusLink(server.url, timeout=TIMEOUT)
        values = {"command": CommandCode.HOLD, "sequence": 999, "preset": 0.0, "amplitude": 0.0, "frequency": 0.0}
        values |= {"detector": 0, "action": 0, "limit": 0.0}
        intruder.write_holding(COMMAND.address, COMMAND.pack(values))
        intruder.close()
        with pytest.raises(
            modbus.ModbusProtocolError, match=r"command 999 is in force, which this program did not send"
        ):
            driver.measured()


def test_a_new_client_goes_on_from_the_sequence_of_the_one_before(server: Server) -> None:
    for _ in range(3):
        with tester.connect(server.url, timeout=TIMEOUT) as driver:
            driver.start()
            assert driver.status().state is State.IDLE
    assert server.device.applied.count(CommandCode.HYDRAULICS_ON) == 3


def test_the_heart_beats_while_the_owner_computes(server: Server) -> None:
    with tester.connect(server.url, timeout=TIMEOUT) as driver:
        driver.start()
        time.sleep(1.5 * WATCHDOG_TIME)
        assert driver.status().state is State.IDLE


def test_the_watchdog_stops_the_actuator_when_the_thread_that_owns_it_dies(server: Server) -> None:
    def die() -> None:
        driver = tester.connect(server.url, timeout=TIMEOUT).__enter__()
        set_cycling(driver)
        abandoned.append(driver)

    abandoned: list[tester.Tester] = []
    owner = threading.Thread(target=die)
    owner.start()
    owner.join()
    until(lambda: at_rest(server))
    assert server.device.status()["interlocks"] == Interlock.WATCHDOG
    abandoned[0].close()
    abandoned[0]._wire._link.close()


def test_commands_from_two_threads_do_not_mix(server: Server) -> None:
    failures: list[RigError] = []
    with tester.connect(server.url, timeout=TIMEOUT) as driver:
        driver.start()
        driver.preset(5e-4)

        def cycle(frequency: float) -> None:
            try:
                for _ in range(20):
                    driver.cycle(1e-4, frequency)
            except RigError as error:
                failures.append(error)

        threads = [threading.Thread(target=cycle, args=(frequency,)) for frequency in (20.0, 30.0)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert failures == []
    assert server.device.applied.count(CommandCode.CYCLE) == 40
