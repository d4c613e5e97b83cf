"""Modbus to one device, by URL: with `rig.tester.codec_framer` the only module of the rig that knows pymodbus.

Every call is one transaction, ends within its timeout from connecting to the last byte of the reply, and either returns
or raises one of three errors: no answer, a refusal by the device, or a reply that does not answer the request (another
transaction, unit, function, address or length, or an echo). A write is sent once and never repeated here, because a
write whose reply was lost has been done; a caller that repeats it has to make that harmless. An urgent call goes before
all that wait; a call that waits for its reply at that moment has only `HURRY` s left. A codec (`rig.tester.codec`) puts
frames of another protocol in place of those of Modbus, and changes nothing else.
"""

import logging
import math
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TypeVar
from urllib.parse import parse_qs, urlsplit

import serial
from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.constants import ExcCodes
from pymodbus.exceptions import ConnectionException, ModbusException, ModbusIOException
from pymodbus.pdu import ModbusPDU
from pymodbus.pdu.register_message import WriteMultipleRegistersResponse
from pymodbus.transport import CommParams

from rig.errors import RigError
from rig.fair_lock import FairLock
from rig.serial_line import LINE_ERRORS, OPENING_ERRORS
from rig.tester.codec import TesterCodec
from rig.tester.codec_framer import CodecError, CodecFramer

DEFAULT_PORT = 502
DEFAULT_BAUD_RATE = 19_200
DEVICE_ID = 1  # Modbus unit number
HURRY = 0.05  # s that a reply may still take where an urgent request waits; a sound instrument answers in a few ms
SLICE = 0.01  # s between two looks at whether an urgent request waits
SERIAL_PAUSE = 0.001  # s between two looks at a serial line
READ_HOLDING, READ_INPUT, WRITE_COIL, WRITE_HOLDING = 3, 4, 5, 16  # function codes
EXCEPTION = 0x80  # the bit of a function code in a reply that refuses

_REASONS = {
    ExcCodes.ILLEGAL_FUNCTION: "it has no such function",
    ExcCodes.ILLEGAL_ADDRESS: "it has no such register, or one that may not be written",
    ExcCodes.ILLEGAL_VALUE: "it does not accept the value",
    ExcCodes.DEVICE_FAILURE: "it cannot do that now",
    ExcCodes.ACKNOWLEDGE: "it has begun and is not ready yet",
    ExcCodes.DEVICE_BUSY: "it is busy",
    ExcCodes.NEGATIVE_ACKNOWLEDGE: "it cannot do that",
    ExcCodes.MEMORY_PARITY_ERROR: "its memory is damaged",
    ExcCodes.GATEWAY_PATH_UNAVIABLE: "the gateway has no path to it",
    ExcCodes.GATEWAY_NO_RESPONSE: "it does not answer the gateway",
}
"""Why a device refused, by the code of its exception."""

Around = Callable[[], AbstractContextManager[None]]
"""Makes a context in which a frame is passed to the operating system; it raises where that must not happen any more."""

_Response = TypeVar("_Response", bound=ModbusPDU)
log = logging.getLogger(__name__)


class ModbusUnreachableError(RigError):
    """No answer in time, no connection, or a lost one; the request may have been done."""


class ModbusRefusedError(RigError):
    """The device answered with a Modbus exception.

    Attributes:
        code: the exception code.
    """

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code

    @property
    def busy(self) -> bool:
        """Whether the device only asks to be asked again later."""
        return self.code == ExcCodes.DEVICE_BUSY


class ModbusProtocolError(RigError):
    """The reply does not answer the request."""


class ModbusLink:
    """One device on Modbus TCP (``tcp://host:port``) or RTU (``rtu:///dev/ttyS0?baudrate=19200``).

    Any thread may call it; requests go out one at a time. It connects with the first request and again after a failure.

    Args:
        url: where the device is; RTU takes baudrate, parity (N, E, O) and stopbits as query.
        timeout: of each request, from connecting to the end of the reply, s.
        codec: of a controller with another protocol, whose URL is ``name+tcp://host:port`` or
            ``name+serial:///dev/ttyS0?baudrate=19200``.

    Raises:
        RigError: the URL is not one of those forms.
    """

    def __init__(self, url: str, timeout: float = 0.5, codec: TesterCodec | None = None) -> None:
        self.url = url
        self.timeout = timeout
        self._lock = FairLock()
        self._client = _client(url, timeout, codec)
        self._client.register(_WriteReply)
        self._client.is_overtaken = lambda: self._lock.is_urgent
        # every failure is raised from here; pymodbus would log it a second time
        logging.getLogger("pymodbus").setLevel(logging.CRITICAL)

    def read_input(self, address: int, count: int, by: float = math.inf, *, urgent: bool = False) -> list[int]:
        """Read `count` input registers from `address`; ends `by` this time of `time.monotonic`.

        Raises:
            ModbusUnreachableError, ModbusRefusedError, ModbusProtocolError: see there.
        """
        return self._read(READ_INPUT, address, count, by, urgent)

    def read_holding(self, address: int, count: int, by: float = math.inf, *, urgent: bool = False) -> list[int]:
        """Read `count` holding registers; like `read_input`."""
        return self._read(READ_HOLDING, address, count, by, urgent)

    def _read(self, function: int, address: int, count: int, by: float, urgent: bool) -> list[int]:
        kind = "input" if function == READ_INPUT else "holding"
        what = f"read {count} {kind} registers from {address}"
        client = self._client
        read = client.read_input_registers if function == READ_INPUT else client.read_holding_registers
        with self._locked(what, by, urgent):
            response = self._ask(what, function, lambda: read(address, count=count, device_id=DEVICE_ID))
        if len(response.registers) != count:
            raise ModbusProtocolError(f"{self.url}: asked to {what}, {len(response.registers)} came")
        return list(response.registers)

    def write_holding(
        self,
        address: int,
        words: Sequence[int],
        by: float = math.inf,
        sending: Around = nullcontext,
        *,
        urgent: bool = False,
    ) -> None:
        """Write `words` to the holding registers from `address`, sent once, in the context `sending`.

        Ends `by` this time of `time.monotonic`.

        Raises:
            ModbusUnreachableError: no reply; whether the words were taken is unknown.
            ModbusRefusedError, ModbusProtocolError: see there.
        """
        what = f"write {len(words)} holding registers from {address}"
        with self._locked(what, by, urgent, sending):
            response = self._ask(
                what, WRITE_HOLDING, lambda: self._client.write_registers(address, list(words), device_id=DEVICE_ID)
            )
        if (response.address, response.count) != (address, len(words)):
            raise ModbusProtocolError(
                f"{self.url}: asked to {what}, the reply is for {response.count} from {response.address}"
            )

    def write_coil(
        self, address: int, value: bool, by: float = math.inf, sending: Around = nullcontext, *, urgent: bool = False
    ) -> None:
        """Write one coil, sent once, in the context `sending`; ends `by` this time of `time.monotonic`.

        Raises:
            ModbusUnreachableError: no reply; whether the coil was taken is unknown.
            ModbusRefusedError, ModbusProtocolError: see there.
        """
        what = f"write coil {address}"
        with self._locked(what, by, urgent, sending):
            response = self._ask(what, WRITE_COIL, lambda: self._client.write_coil(address, value, device_id=DEVICE_ID))
        if (response.address, list(response.bits)) != (address, [value]):
            raise ModbusProtocolError(
                f"{self.url}: asked to {what}, the reply is for coil {response.address} and says {response.bits}"
            )

    def connect(self) -> None:
        """Connect within `timeout` s, for urgent requests, which have less; where it fails, they try it themselves."""
        with self._lock:
            self._client.begin(time.monotonic() + self.timeout, nullcontext)
            try:
                self._client.connect()
            except ConnectionException as error:
                log.info("%s: no connection yet: %s", self.url, error)

    def close(self) -> None:
        """Close the connection."""
        with self._lock:
            self._disconnect()

    def _disconnect(self) -> None:
        self._client.close()  # type: ignore[no-untyped-call]  # pymodbus leaves it without types

    def _ask(self, what: str, function: int, request: Callable[[], _Response]) -> _Response:
        try:
            response = request()
        except (ConnectionException, OSError) as error:
            self._disconnect()
            raise ModbusUnreachableError(
                f"{self.url}: no connection to {what}; check its power and its line"
            ) from error
        except ModbusIOException as error:
            # closed, so that a late reply is not taken for the answer to the next request
            self._disconnect()
            raise ModbusUnreachableError(f"{self.url}: no reply when asked to {what}") from error
        except CodecError as error:
            self._disconnect()
            raise ModbusProtocolError(f"{self.url}: asked to {what}, {error}") from error
        except (ModbusException, ValueError, IndexError) as error:
            self._disconnect()
            raise ModbusProtocolError(f"{self.url}: asked to {what}, the reply makes no sense ({error})") from error
        if response.function_code & ~EXCEPTION != function:
            self._disconnect()
            raise ModbusProtocolError(f"{self.url}: asked to {what}, function {response.function_code} is answered")
        if response.isError():
            code = int(getattr(response, "exception_code", 0))
            reason = _REASONS.get(ExcCodes(code), "") if code in set(ExcCodes) else ""
            raise ModbusRefusedError(f"{self.url} refused to {what}: {reason or f'exception code {code}'}", code)
        return response

    @contextmanager
    def _locked(self, what: str, by: float, urgent: bool, sending: Around = nullcontext) -> Iterator[None]:
        """Wait for other requests, while there is time left for a reply: `HURRY` s if urgent, else the timeout."""
        longest = by - time.monotonic() - (HURRY if urgent else self.timeout)
        if not self._lock.acquire(longest, urgent=urgent):
            raise ModbusUnreachableError(
                f"{self.url}: not asked to {what}, other requests still wait for their replies"
            )
        try:
            self._client.begin(min(time.monotonic() + self.timeout, by), sending)
            yield
        finally:
            self._lock.release()


class _WriteReply(WriteMultipleRegistersResponse):
    """The reply to a write of registers, which is shorter than the request; pymodbus takes an echo of that for it."""

    def decode(self, data: bytes) -> None:
        """Take the fields from `data`. Raises ValueError where it is longer than a reply."""
        if len(data) != 4:
            raise ValueError(f"{len(data)} bytes for the 4 of a reply")
        super().decode(data)


class _Deadline:
    """The time that one request has, and the context in which it is sent."""

    is_overtaken: Callable[[], bool]
    comm_params: CommParams
    sending: Around
    end: float

    def begin(self, end: float, sending: Around) -> None:
        """Begin a request that ends at `end` of `time.monotonic`, whatever it waits for until then."""
        self.end, self.sending = end, sending
        self.comm_params.timeout_connect = max(end - time.monotonic(), SLICE)

    def left(self) -> float:
        """Time that is left, s; little where an urgent request waits."""
        now = time.monotonic()
        if self.is_overtaken():
            self.end = min(self.end, now + HURRY)
        return self.end - now


class _TcpClient(_Deadline, ModbusTcpClient):
    """A client whose timeout is that of a whole request, and which waits for any descriptor, also beyond 1,024."""

    def connect(self) -> bool:
        """Connect; from the second time on without asking for the address of a host name again."""
        connected = bool(super().connect())  # type: ignore[no-untyped-call]  # pymodbus leaves it without types
        if self.socket is not None:
            self.comm_params.host = self.socket.getpeername()[0]
        return connected

    def send(self, request: bytes, addr: tuple[str, int] | None = None) -> int:
        """Send `request`."""
        with self.sending():
            return int(super().send(request, addr))

    def recv(self, size: int | None) -> bytes:
        """The bytes that have come, looked for at least once; none where the time is over."""
        while self.socket is not None:
            left = self.left()
            self.socket.settimeout(min(max(left, 0.0), SLICE))
            try:
                data = self.socket.recv(size or 4096)
            except (TimeoutError, BlockingIOError):
                if left <= 0.0:
                    return b""
            else:
                if not data:
                    break
                return data
        raise ConnectionException("the other end has closed it")


class _SerialClient(_Deadline, ModbusSerialClient):
    """A client on a serial line, with a deadline for each request."""

    def connect(self) -> bool:
        """Open the port, for reading by `poll`. Raises ConnectionException where that fails."""
        if self.socket is None:
            line = self.comm_params
            try:
                self.socket = serial.PosixPollSerial(
                    line.host, line.baudrate, line.bytesize, line.parity, line.stopbits, timeout=0, exclusive=True
                )
            except OPENING_ERRORS as error:
                raise ConnectionException(str(error)) from error
        return True

    def send(self, request: bytes, addr: tuple[str, int] | None = None) -> int:  # noqa: ARG002 - the port is the address
        """Send `request`; what came before, for another one, is dropped.

        Raises ConnectionException where the port is closed or was unplugged.
        """
        if self.socket is None:
            raise ConnectionException("the port is closed")
        try:
            self.socket.reset_input_buffer()
            with self.sending():
                sent = os.write(self.socket.fileno(), request)
        except LINE_ERRORS as error:
            raise ConnectionException(str(error)) from error
        if sent < len(request):
            raise ConnectionException("the port takes no more")
        return sent

    def recv(self, size: int | None) -> bytes:  # noqa: ARG002 - a frame ends where its content says
        """The bytes that have come, looked for at least once; none where the time is over."""
        while self.socket is not None:
            left = self.left()
            if waiting := self.socket.in_waiting:
                return bytes(self.socket.read(waiting))
            if left <= 0.0:
                return b""
            time.sleep(SERIAL_PAUSE)
        raise ConnectionException("the port is closed")


def _client(url: str, timeout: float, codec: TesterCodec | None) -> _TcpClient | _SerialClient:
    client: _TcpClient | _SerialClient
    try:
        parts = urlsplit(url)
        scheme = parts.scheme if codec is None else parts.scheme.rpartition("+")[2]
        port = parts.netloc + parts.path
        if scheme == "tcp" and parts.hostname:
            client = _TcpClient(parts.hostname, port=parts.port or DEFAULT_PORT, timeout=timeout, retries=0)
        elif scheme == ("rtu" if codec is None else "serial") and port:
            options = {name: values[-1] for name, values in parse_qs(parts.query).items()}
            client = _SerialClient(
                port,
                framer=FramerType.RTU,
                baudrate=int(options.get("baudrate", DEFAULT_BAUD_RATE)),
                parity=options.get("parity", "N"),
                stopbits=int(options.get("stopbits", 1)),
                timeout=timeout,
                retries=0,
            )
        else:
            raise ValueError("there is no such line")
    except ValueError as error:
        forms = "tcp://host:port or rtu:///dev/ttyS0?baudrate=19200"
        if codec is not None:
            forms = "name+tcp://host:port or name+serial:///dev/ttyS0?baudrate=19200, with the name of a plug-in"
        raise RigError(f"{url!r} is no address of a tester ({error}); write {forms}") from error
    if codec is not None:
        client.framer = client.transaction.framer = CodecFramer(codec)
    return client
