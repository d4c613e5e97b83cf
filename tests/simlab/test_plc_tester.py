"""The second simulated tester as its wire shows it, without our driver and its maps."""

import struct
import time
from collections.abc import Iterator

import pytest
from pymodbus.client import ModbusTcpClient

from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.plc_tester import PlcTesterServer, start_plc_tester
from simlab.tester_device import DeviceLimits
from tests.waiting import until

OFF, ON, HOLD, GO, CYCLE, RESET = 0, 1, 2, 3, 5, 8


class Wire:
    """A client that knows the layout by heart."""

    def __init__(self, server: PlcTesterServer) -> None:
        self.client = ModbusTcpClient("127.0.0.1", port=int(server.url.rpartition(":")[2]), retries=0)

    def read(self, address: int, count: int = 1) -> list[int]:
        return list(self.client.read_holding_registers(address, count=count).registers)

    def write(self, address: int, *words: int) -> bool:
        return not self.client.write_registers(address, list(words)).isError()

    def low_first(self, layout: str, address: int) -> float:
        low, high = self.read(address, 2)
        return float(struct.unpack(layout, struct.pack(">HH", high, low))[0])

    def set(self, position_mm: float, amplitude_mm: float, frequency: float) -> None:
        for address, layout, value in ((258, ">i", round(1e5 * position_mm)), (260, ">f", amplitude_mm)):
            high, low = struct.unpack(">HH", struct.pack(layout, value))
            assert self.write(address, low, high)
        assert self.write(262, round(100 * frequency))


@pytest.fixture
def server() -> Iterator[PlcTesterServer]:
    bench = ordinary_bench(5, Clock(100.0))
    bench.mount("I", "shear")
    server = start_plc_tester(bench, limits=DeviceLimits(watchdog_time=0.5))
    yield server
    server.stop()


@pytest.fixture
def wire(server: PlcTesterServer) -> Iterator[Wire]:
    wire = Wire(server)
    yield wire
    wire.client.close()  # type: ignore[no-untyped-call]  # pymodbus leaves it without types


def set_cycling(wire: Wire) -> None:
    wire.set(0.5, 0.05, 50.0)
    assert wire.write(256, ON)
    assert wire.write(256, GO)
    until(lambda: wire.read(512) == [0b00101])
    assert wire.write(256, CYCLE)
    until(lambda: wire.read(512) == [0b11001])


def test_it_is_what_it_says_and_cycles_as_it_is_set(wire: Wire) -> None:
    assert wire.read(16, 2) == [5012, 310]
    assert wire.low_first(">I", 18) == 70_001
    set_cycling(wire)
    assert wire.low_first(">i", 514) == pytest.approx(50_000, abs=1)
    assert 0.05 < wire.low_first(">f", 516) < 0.1  # below what is commanded, peak to peak
    assert wire.low_first(">f", 524) == pytest.approx(0.05)
    assert wire.read(526) == [5000]
    counted = wire.low_first(">I", 518)
    until(lambda: wire.low_first(">I", 518) > counted)


def test_a_cycle_that_is_refused_is_not_in_force(wire: Wire) -> None:
    set_cycling(wire)
    wire.set(0.5, 0.4, 50.0)  # beyond its amplitude limit
    assert not wire.write(256, CYCLE)
    assert wire.low_first(">f", 524) == pytest.approx(0.05)


def test_it_plays_no_fault_of_registers_that_it_has_not(server: PlcTesterServer) -> None:
    with pytest.raises(ValueError, match="no fault 'mild_detector'"):
        server.faults.set("mild_detector")
    with pytest.raises(ValueError, match="no fault 'flipped_command'"):
        server.faults.set("flipped_command")


def test_hold_off_and_the_coil_stop_it(wire: Wire, server: PlcTesterServer) -> None:
    set_cycling(wire)
    assert wire.write(256, HOLD)
    until(lambda: wire.read(512) == [0b00101])
    assert wire.write(256, OFF)
    until(lambda: wire.read(512) == [0])
    assert wire.write(256, HOLD)  # with pressure off it does not bring it back
    assert wire.read(512) == [0]
    set_cycling(wire)
    assert not wire.client.write_coil(3, True).isError()
    assert wire.read(512, 2) == [0b1000_0000, 1]
    until(lambda: not server.device.is_moving())
    assert not wire.write(256, ON)
    assert wire.write(256, RESET)
    assert wire.read(512, 2) == [0, 0]


def test_its_watchdog_stops_it_and_a_life_counter_that_changes_does_not_let_it(wire: Wire) -> None:
    set_cycling(wire)
    for count in range(1, 8):
        assert wire.write(270, count)
        time.sleep(0.1)  # longer than the watchdog time in all
        assert wire.read(513) == [0]
    until(lambda: wire.read(513) == [0b10])


def test_what_it_has_not_is_refused(wire: Wire) -> None:
    assert not wire.write(256, 77)
    assert not wire.write(300, 1)
    wire.set(0.5, 5.0, 50.0)
    assert wire.write(256, ON)
    assert not wire.write(256, CYCLE)  # not at a position yet
