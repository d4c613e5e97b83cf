"""Modbus to one device, by URL: the only module of the rig that knows pymodbus.

Every call is one transaction, ends within a bounded time, and either returns or raises one of three errors: no answer,
a refusal by the device, or a reply that makes no sense. A write is sent once and never repeated here, because a write
whose reply was lost has been done; a caller that repeats it has to make that harmless.
"""

import logging
import math
import select
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TypeVar
from urllib.parse import parse_qs, urlsplit

from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.constants import ExcCodes
from pymodbus.exceptions import ConnectionException, ModbusException, ModbusIOException
from pymodbus.pdu import ModbusPDU

from rig.errors import RigError
from rig.fair_lock import FairLock

DEFAULT_PORT = 502
DEFAULT_BAUD_RATE = 19_200
DEVICE_ID = 1  # Modbus unit number

_WORDS = {
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

Around = Callable[[], AbstractContextManager[None]]
"""Makes a context in which a frame is passed to the operating system; it raises where that must not happen any more."""

_Response = TypeVar("_Response", bound=ModbusPDU)


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
        timeout: of connecting and of each reply, s.

    Raises:
        RigError: the URL is not one of those two forms.
    """

    def __init__(self, url: str, timeout: float = 0.5) -> None:
        self.url = url
        self.timeout = timeout
        self._client = _client(url, timeout)
        self._lock = FairLock()
        # every failure is raised from here; pymodbus would log it a second time
        logging.getLogger("pymodbus").setLevel(logging.CRITICAL)

    def read_input(self, address: int, count: int, by: float = math.inf) -> list[int]:
        """Read `count` input registers from `address`; ends `by` this time of `time.monotonic`.

        Raises:
            ModbusUnreachableError, ModbusRefusedError, ModbusProtocolError: see there.
        """
        what = f"read {count} input registers from {address}"
        response = self._ask(
            what, lambda: self._client.read_input_registers(address, count=count, device_id=DEVICE_ID), by
        )
        if len(response.registers) != count:
            raise ModbusProtocolError(f"{self.url}: asked to {what}, {len(response.registers)} came")
        return list(response.registers)

    def write_holding(
        self, address: int, words: Sequence[int], by: float = math.inf, sending: Around = nullcontext
    ) -> None:
        """Write `words` to the holding registers from `address`, sent once, in the context `sending`; ends `by` then.

        Raises:
            ModbusUnreachableError: no reply; whether the words were taken is unknown.
            ModbusRefusedError, ModbusProtocolError: see there.
        """
        what = f"write {len(words)} holding registers from {address}"
        self._ask(what, lambda: self._client.write_registers(address, list(words), device_id=DEVICE_ID), by, sending)

    def write_coil(self, address: int, value: bool, by: float = math.inf) -> None:
        """Write one coil, sent once; ends `by` this time of `time.monotonic`.

        Raises:
            ModbusUnreachableError: no reply; whether the coil was taken is unknown.
            ModbusRefusedError, ModbusProtocolError: see there.
        """
        what = f"write coil {address}"
        self._ask(what, lambda: self._client.write_coil(address, value, device_id=DEVICE_ID), by)

    def close(self) -> None:
        """Close the connection."""
        with self._lock:
            self._disconnect()

    def _disconnect(self) -> None:
        self._client.close()  # type: ignore[no-untyped-call]  # pymodbus leaves it without types

    def _ask(self, what: str, request: Callable[[], _Response], by: float, sending: Around = nullcontext) -> _Response:
        with self._locked(what, by):
            self._client.sending = sending
            try:
                response = request()
            except (ConnectionException, OSError) as error:
                self._disconnect()
                raise ModbusUnreachableError(f"{self.url}: no connection to {what} ({error})") from error
            except ModbusIOException as error:
                # closed, so that a late reply is not taken for the answer to the next request
                self._disconnect()
                raise ModbusUnreachableError(f"{self.url}: no reply when asked to {what}") from error
            except (ModbusException, ValueError, IndexError) as error:
                self._disconnect()
                raise ModbusProtocolError(f"{self.url}: asked to {what}, the reply makes no sense ({error})") from error
        if response.isError():
            code = int(getattr(response, "exception_code", 0))
            words = _WORDS.get(ExcCodes(code), "") if code in set(ExcCodes) else ""
            raise ModbusRefusedError(f"{self.url} refused to {what}: {words or f'exception code {code}'}", code)
        return response

    @contextmanager
    def _locked(self, what: str, by: float) -> Iterator[None]:
        """Wait for the requests of other threads, as long as there is time for a reply."""
        if not self._lock.acquire(by - self.timeout - time.monotonic()):
            raise ModbusUnreachableError(
                f"{self.url}: not asked to {what}, other requests still wait for their replies"
            )
        try:
            yield
        finally:
            self._lock.release()


class _TcpClient(ModbusTcpClient):
    """A client whose timeout is that of the whole reply; in pymodbus it is that of each piece of one."""

    sending: Around = nullcontext
    _end = 0.0

    def send(self, request: bytes, addr: tuple[str, int] | None = None) -> int:
        """Send `request`, and begin to wait."""
        self._end = time.monotonic() + (self.comm_params.timeout_connect or 0.0)
        with self.sending():
            return int(super().send(request, addr))

    def recv(self, size: int | None) -> bytes:
        """The bytes that have come; none once the time is over."""
        left = max(self._end - time.monotonic(), 0.0)
        if self.socket and not select.select([self.socket], [], [], left)[0]:
            return b""
        return bytes(super().recv(size))


class _SerialClient(ModbusSerialClient):
    """A client on a serial line."""

    sending: Around = nullcontext

    def send(self, request: bytes, addr: tuple[str, int] | None = None) -> int:
        """Send `request`."""
        with self.sending():
            return int(super().send(request, addr))


def _client(url: str, timeout: float) -> _TcpClient | _SerialClient:
    try:
        parts = urlsplit(url)
        if parts.scheme == "tcp" and parts.hostname:
            return _TcpClient(parts.hostname, port=parts.port or DEFAULT_PORT, timeout=timeout, retries=0)
        port = parts.netloc + parts.path
        if parts.scheme == "rtu" and port:
            options = {name: values[-1] for name, values in parse_qs(parts.query).items()}
            return _SerialClient(
                port,
                framer=FramerType.RTU,
                baudrate=int(options.get("baudrate", DEFAULT_BAUD_RATE)),
                parity=options.get("parity", "N"),
                stopbits=int(options.get("stopbits", 1)),
                timeout=timeout,
                retries=0,
            )
    except ValueError as error:
        raise RigError(f"{url!r} is no Modbus address: {error}") from error
    raise RigError(f"{url!r} is no Modbus address; write tcp://host:port or rtu:///dev/ttyS0?baudrate=19200")
