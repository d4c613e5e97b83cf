"""A tester on a line that is not Modbus: driven as any other, whatever its codec does."""

import threading
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from dataclasses import replace

import pytest

from rig.errors import RigError, RunStoppedError
from rig.registers import COMMAND, CommandCode, State
from rig.tester import driver as tester
from rig.tester.codec import RegisterRequest, TesterCodec, WriteRegisters
from rig.tester.modbus import ModbusLink, ModbusProtocolError, ModbusRefusedError, ModbusUnreachableError
from rig.tester.monitor import poll_tester
from rig.tester.register_map import OURS
from rig.tester.status import ActuatorNotAtRestError, TesterRefusedError
from rig.tester.stop_latch import StopLatch
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.tester_device import DeviceLimits
from simlab.tester_server import TesterServer, start_tester_server
from tests.rig.text_tester import TextCodec, TextTester
from tests.waiting import LONG, until

TEXT = replace(OURS, codec=TextCodec())


def commanded(request: RegisterRequest) -> CommandCode:
    """The command that a request carries out; NONE for any other request."""
    if isinstance(request, WriteRegisters) and request.address == COMMAND.address:
        return CommandCode(request.words[COMMAND.address_of("command") - COMMAND.address])
    return CommandCode.NONE


@pytest.fixture
def machine() -> Iterator[TesterServer]:
    bench = ordinary_bench(11, Clock(speed=200.0))
    bench.mount("I", "shear")
    server = start_tester_server(bench, limits=DeviceLimits(watchdog_time=1.0))
    yield server
    server.stop()


@pytest.fixture
def line(machine: TesterServer) -> Iterator[TextTester]:
    with closing(TextTester(machine.url)) as found:
        yield found


def test_a_day_at_a_tester_that_speaks_text(line: TextTester, machine: TesterServer) -> None:
    with tester.connect(line.url, tester_map=TEXT) as driver:
        assert driver.identity.serial == "SIM-ET-0001"
        driver.start()
        driver.preset(5e-4)
        driver.cycle(1e-4, 50.0)
        status = driver.wait(lambda status: status.state is State.SETTLED and status.cycles > 20, "settle")
        assert status.displacement_pp[0] == pytest.approx(1e-4, rel=0.3)
        driver.halt()
        driver.check_obeys()
    assert machine.device.status()["state"] == State.HYDRAULICS_OFF
    assert poll_tester(line.url, TEXT).state is State.HYDRAULICS_OFF


def test_a_stop_in_force_keeps_every_command_that_moves_from_the_line(line: TextTester) -> None:
    latch = StopLatch()
    with tester.connect(line.url, latch=latch, tester_map=TEXT) as driver:
        driver.start()
        driver.preset(5e-4)
        sent = [each for each in line.lines if each.startswith(f"W {COMMAND.address} ")]
        latch.stop("a person", "to see")
        for move in (driver.start, lambda: driver.preset(1e-4), lambda: driver.cycle(1e-4, 50.0)):
            with pytest.raises(RunStoppedError):
                move()
        assert [each for each in line.lines if each.startswith(f"W {COMMAND.address} ")] == sent


def test_a_tester_that_refuses_and_one_that_is_busy_are_told_apart(line: TextTester, machine: TesterServer) -> None:
    with tester.connect(line.url, tester_map=TEXT) as driver:
        with pytest.raises(TesterRefusedError, match="hydraulics are off"):
            driver.cycle(1e-4, 50.0)
        machine.faults.set("busy", 1)
        driver.start()  # asked again
    assert machine.device.applied.count(CommandCode.HYDRAULICS_ON) == 1


class Failing(TextCodec):
    """Does wrong what it is told to do wrong."""

    encodes: Callable[[RegisterRequest], bytes] | None = None
    decodes: Callable[[bytes], object] | None = None

    def encode(self, request: RegisterRequest) -> bytes:
        return super().encode(request) if self.encodes is None else self.encodes(request)

    def decode(self, request: RegisterRequest, received: bytes) -> list[int] | None:
        if self.decodes is not None:
            return self.decodes(received)  # type: ignore[return-value]  # what a wrong codec returns
        return super().decode(request, received)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"encodes": lambda _: dict[str, bytes]()["address"]}, "could not encode a request .KeyError: 'address'"),
        ({"encodes": lambda _: "R 3 0 1"}, "which are no bytes"),
        ({"decodes": lambda _: [1, 2]}, "2 came"),
        ({"decodes": lambda _: [70_000]}, "could not decode the reply to a request .error"),
        ({"decodes": lambda _: "?"}, "could not decode"),
        ({"decodes": lambda received: received.decode("utf-16")}, "could not decode"),
    ],
)
def test_what_is_wrong_with_a_codec_is_named(wrong: dict[str, object], says: str, line: TextTester) -> None:
    codec = Failing()
    vars(codec).update(wrong)
    with closing(ModbusLink(line.url, 0.2, codec)) as link, pytest.raises(ModbusProtocolError, match=says):
        link.read_holding(0, 1)


def test_a_codec_that_waits_for_more_for_ever_ends_in_time(line: TextTester) -> None:
    codec = Failing()
    codec.decodes = lambda _: None
    with closing(ModbusLink(line.url, 0.2, codec)) as link, pytest.raises(ModbusUnreachableError, match="no reply"):
        link.read_holding(0, 1)


def test_an_answer_to_something_else_is_not_taken(line: TextTester) -> None:
    line.answer = b"ok\n"
    with closing(ModbusLink(line.url, 0.2, TextCodec())) as link:
        with pytest.raises(ModbusProtocolError, match="answers something else"):
            link.read_holding(0, 1)
        line.answer = b"busy\n"
        with pytest.raises(ModbusRefusedError, match="it is busy"):
            link.write_holding(0, [1])


class Hanging(TextCodec):
    """Hangs in the middle of a command that moves."""

    def __init__(self) -> None:
        self.hangs, self.goes_on = threading.Event(), threading.Event()

    def encode(self, request: RegisterRequest) -> bytes:
        if commanded(request) is CommandCode.CYCLE:
            self.hangs.set()
            self.goes_on.wait()
        return super().encode(request)


def test_a_codec_that_hangs_keeps_neither_the_latch_nor_the_watchdog_from_acting(
    line: TextTester, machine: TesterServer
) -> None:
    codec, latch = Hanging(), StopLatch()
    with suppress(RigError), tester.connect(line.url, latch=latch, tester_map=replace(OURS, codec=codec)) as driver:
        driver.start()
        driver.preset(5e-4)
        moving = threading.Thread(target=moves, args=(driver,))
        moving.start()
        assert codec.hangs.wait(LONG)
        latch.stop("a person", "it hangs")
        assert moving.is_alive()
        with pytest.raises(ActuatorNotAtRestError, match="the watchdog of the tester should stop it"):
            driver.halt()
        until(lambda: machine.device.status()["state"] == State.TRIPPED)
        codec.goes_on.set()  # too late: STOP is checked after the bytes are made
        moving.join()
    assert CommandCode.CYCLE not in machine.device.applied


def moves(driver: tester.Tester) -> None:
    with suppress(RigError):
        driver.cycle(1e-4, 50.0)


@pytest.mark.parametrize("url", ["text+rtu:///dev/ttyS0", "text+udp://host:1", "text+tcp://", "nothing"])
def test_an_address_of_no_line_is_refused(url: str) -> None:
    codec: TesterCodec = TextCodec()
    with pytest.raises(RigError, match=r"is no address of a tester .*name\+tcp://host:port"):
        ModbusLink(url, codec=codec)
