"""The Modbus link and a device that answers wrongly, late, in pieces, to another request, or not at all."""

import os
import resource
import socket
import struct
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager

import pytest

from rig.registers import STATUS
from rig.tester.modbus import ModbusLink, ModbusProtocolError, ModbusRefusedError, ModbusUnreachableError
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.tester_server import start_tester_server
from tests.waiting import LONG, until

TIMEOUT = 0.2  # s

Reply = Callable[[bytes], Iterator[bytes]]
"""Makes the pieces of the reply to a request, waiting as long as it likes between them."""


def frame(request: bytes, pdu: bytes, *, transaction: int = 0, unit: int = 0) -> bytes:
    """A reply to `request`; transaction and unit are off by so much."""
    number = (int.from_bytes(request[:2]) + transaction) % 0x10000
    return struct.pack(">HHHB", number, 0, len(pdu) + 1, (request[6] + unit) % 256) + pdu


def registers(request: bytes, function: int = 4) -> bytes:
    count = int.from_bytes(request[10:12])
    return struct.pack(f">BB{count}H", function, 2 * count, *range(count))


class Device:
    """A TCP server of one connection at a time that answers each request as it was told to.

    Attributes:
        connections: made so far.
        requests: that came.
    """

    def __init__(self, reply: Reply) -> None:
        self.reply = reply
        self.connections = 0
        self.requests = list[bytes]()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"tcp://127.0.0.1:{self._listener.getsockname()[1]}"
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            self.connections += 1
            with connection:
                try:
                    while request := connection.recv(300):
                        self.requests.append(request)
                        for piece in self.reply(request):
                            connection.sendall(piece)
                except OSError:
                    continue

    def stop(self) -> None:
        self._listener.close()


@contextmanager
def linked(reply: Reply, timeout: float = TIMEOUT) -> Iterator[tuple[ModbusLink, Device]]:
    device = Device(reply)
    with closing(ModbusLink(device.url, timeout)) as link:
        yield link, device
    device.stop()


def sound(request: bytes) -> Iterator[bytes]:
    match request[7]:
        case 4:
            yield frame(request, registers(request))
        case _:
            yield frame(request, request[7:12])


def echo(request: bytes) -> Iterator[bytes]:
    yield request


def silent(request: bytes) -> Iterator[bytes]:
    yield from ()


def trickling(request: bytes) -> Iterator[bytes]:
    for byte in frame(request, registers(request)):
        time.sleep(TIMEOUT / 10)
        yield bytes([byte])


def babbling(request: bytes) -> Iterator[bytes]:
    """Replies to another transaction, without end."""
    for _ in range(1000):
        time.sleep(TIMEOUT / 20)
        yield frame(request, registers(request), transaction=1)


def endless_frame(request: bytes) -> Iterator[bytes]:
    yield request[:4] + b"\xff\xff" + request[6:7] + bytes(300)


def test_a_sound_device_is_read_and_written() -> None:
    with linked(sound) as (link, device):
        assert link.read_input(100, 3) == [0, 1, 2]
        link.write_holding(200, [7, 8])
        link.write_coil(0, True)
        assert device.connections == 1


@pytest.mark.parametrize("reply", [silent, trickling, babbling, endless_frame], ids=lambda reply: reply.__name__)
def test_a_request_ends_at_its_timeout_whatever_comes(reply: Reply) -> None:
    with linked(reply) as (link, device):
        for number in range(2):
            with pytest.raises(ModbusUnreachableError, match="no reply"):
                link.read_input(100, 60)
            until(lambda number=number: device.connections > number)  # type: ignore[misc]  # a late reply finds nobody


def test_a_reply_to_another_transaction_or_unit_is_not_taken() -> None:
    for transaction, unit in ((1, 0), (-1, 0), (0, 1), (0, 255)):

        def other(request: bytes, transaction: int = transaction, unit: int = unit) -> Iterator[bytes]:
            yield frame(request, registers(request), transaction=transaction, unit=unit)

        with linked(other) as (link, _), pytest.raises(ModbusUnreachableError):
            link.read_input(100, 3)


def test_a_stale_reply_is_passed_over_for_the_right_one() -> None:
    def both(request: bytes) -> Iterator[bytes]:
        yield frame(request, struct.pack(">BB3H", 4, 6, 9, 9, 9), transaction=5) + frame(request, registers(request))

    with linked(both) as (link, _):
        assert link.read_input(100, 3) == [0, 1, 2]


@pytest.mark.parametrize("function", [3, 0x83])
def test_a_reply_with_another_function_code_is_refused(function: int) -> None:
    def other(request: bytes) -> Iterator[bytes]:
        yield frame(request, registers(request, function) if function < 0x80 else bytes([function, 2]))

    with linked(other) as (link, _), pytest.raises(ModbusProtocolError, match=f"function {function} is answered"):
        link.read_input(100, 3)


def test_the_exception_to_the_function_that_was_asked_for_is_a_refusal() -> None:
    def refuse(request: bytes) -> Iterator[bytes]:
        yield frame(request, bytes([request[7] | 0x80, 4]))

    with linked(refuse) as (link, _), pytest.raises(ModbusRefusedError, match="cannot do that now"):
        link.write_holding(210, [1, 2])


def test_an_echoed_request_is_no_reply() -> None:
    with linked(echo) as (link, _):
        for ask in (lambda: link.read_input(100, 3), lambda: link.write_holding(210, [1, 2])):
            with pytest.raises((ModbusUnreachableError, ModbusProtocolError)):
                ask()


@pytest.mark.parametrize(
    ("ask", "pdu"),
    [
        (lambda link: link.write_holding(210, [1, 2]), struct.pack(">BHH", 16, 211, 2)),
        (lambda link: link.write_holding(210, [1, 2]), struct.pack(">BHH", 16, 210, 1)),
        (lambda link: link.write_coil(0, True), struct.pack(">BHH", 5, 1, 0xFF00)),
        (lambda link: link.write_coil(0, True), struct.pack(">BHH", 5, 0, 0)),
        (lambda link: link.read_input(100, 3), struct.pack(">BB2H", 4, 4, 1, 2)),
    ],
    ids=["other address", "fewer", "other coil", "coil off", "fewer read"],
)
def test_a_reply_that_is_for_something_else_is_refused(ask: Callable[[ModbusLink], object], pdu: bytes) -> None:
    def other(request: bytes) -> Iterator[bytes]:
        yield frame(request, pdu)

    with linked(other) as (link, _), pytest.raises(ModbusProtocolError):
        ask(link)


def test_a_device_that_takes_no_connection_costs_one_timeout() -> None:
    with socket.create_server(("127.0.0.1", 0), backlog=0) as listener, ExitStack() as full:
        address = listener.getsockname()
        for _ in range(4):  # fill the queue, so that the next one hangs in connecting
            waiting = socket.socket()
            full.enter_context(closing(waiting))
            waiting.setblocking(False)
            waiting.connect_ex(address)
        began = time.monotonic()
        with closing(ModbusLink(f"tcp://{address[0]}:{address[1]}", TIMEOUT)) as link:
            with pytest.raises(ModbusUnreachableError):
                link.read_input(100, 3)
            assert time.monotonic() - began < 60.0  # the system gives up after two minutes


def test_an_urgent_request_cuts_short_the_wait_for_a_reply_and_goes_first() -> None:
    said = list[str]()

    def reply(request: bytes) -> Iterator[bytes]:
        yield from (sound if request[7] == 5 else silent)(request)

    with linked(reply, timeout=4.0) as (link, device):

        def read(name: str) -> None:
            with pytest.raises(ModbusUnreachableError):
                link.read_input(100, 3, time.monotonic() + 5.0)
            said.append(name)

        waiting = [threading.Thread(target=read, args=(name,)) for name in ("first", "second")]
        for thread in waiting:
            thread.start()
        until(lambda: len(device.requests) == 1 and len(link._lock._waiting) == 1)
        began = time.monotonic()
        link.write_coil(0, True, time.monotonic() + LONG, urgent=True)
        assert time.monotonic() - began < 3.0  # of the 4 s that the reply has
        assert said in ([], ["first"])
        assert [request[7] for request in device.requests][:2] == [4, 5]
        for thread in waiting:
            thread.join(LONG)


@contextmanager
def many_descriptors() -> Iterator[None]:
    """More than 1,024 of them open, the most that `select` can wait for."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard < 2048:
        pytest.skip("this process may not open so many descriptors")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, 2048), hard))
    opened = [os.open(os.devnull, os.O_RDONLY) for _ in range(1100)]
    try:
        yield
    finally:
        for descriptor in opened:
            os.close(descriptor)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


@pytest.mark.parametrize("rtu", [False, True], ids=["tcp", "rtu"])
def test_a_link_works_beyond_1024_descriptors(rtu: bool) -> None:
    server = start_tester_server(ordinary_bench(11, Clock(200.0)), rtu=rtu)
    try:
        with many_descriptors(), closing(ModbusLink(server.url)) as link:
            assert STATUS.unpack(link.read_input(STATUS.address, STATUS.count))["sequence"] == 0
            link.write_coil(0, True)
    finally:
        server.stop()


def test_a_serial_line_that_is_unplugged_is_said() -> None:
    far, near = os.openpty()
    tty.setraw(near)
    path = os.ttyname(near)
    os.close(near)
    with closing(ModbusLink(f"rtu://{path}", TIMEOUT)) as link:
        with pytest.raises(ModbusUnreachableError, match="no reply"):
            link.read_input(100, 3)
        link._client.connect()  # the port is open, as between two requests that were answered
        os.close(far)
        with pytest.raises(ModbusUnreachableError, match="no connection"):
            link.write_coil(0, True)
        assert not link._client.connected  # so that the next request opens it
