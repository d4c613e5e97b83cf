"""The frames of another protocol than Modbus, made by a codec, between the requests and responses of pymodbus."""

import struct
from collections.abc import Iterator
from contextlib import contextmanager

from pymodbus.constants import ExcCodes
from pymodbus.framer import FramerBase
from pymodbus.pdu import DecodePDU, ExceptionResponse, ModbusPDU
from pymodbus.pdu.bit_message import WriteSingleCoilRequest, WriteSingleCoilResponse
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersRequest,
    ReadHoldingRegistersResponse,
    ReadInputRegistersRequest,
    ReadInputRegistersResponse,
    WriteMultipleRegistersRequest,
    WriteMultipleRegistersResponse,
)

from rig.registers import Kind
from rig.tester.codec import (
    ReadRegisters,
    RegisterRefusedError,
    RegisterRequest,
    TesterCodec,
    WriteCoil,
    WriteRegisters,
)


class CodecError(Exception):
    """A codec failed, for a reply that makes no sense or by itself."""


class CodecFramer(FramerBase):
    """Makes the bytes of each request, and the response of the bytes that came."""

    def __init__(self, codec: TesterCodec) -> None:
        super().__init__(DecodePDU(False))
        self._codec = codec
        self._message = ModbusPDU()

    def buildFrame(self, message: ModbusPDU) -> bytes:
        """The bytes of a request. Raises CodecError where there are none."""
        self._message = message
        with self._explained("encode"):
            frame = self._codec.encode(_request_of(message))
            if not isinstance(frame, bytes) or not frame:
                raise TypeError(f"it made {frame!r} of it, which are no bytes")
        return frame

    def handleFrame(self, data: bytes, exp_devid: int, exp_tid: int) -> tuple[int, ModbusPDU | None]:
        """The number of bytes used, and the response, None until it is complete. Raises CodecError."""
        with self._explained("decode the reply to"):
            try:
                words = self._codec.decode(_request_of(self._message), bytes(data))
                if words is None:
                    return 0, None
                struct.pack(f">{len(words)}H", *words)  # raises where one is no word
                response = _response(self._message, list(words))
            except RegisterRefusedError as error:
                code = ExcCodes.DEVICE_BUSY if error.busy else ExcCodes.DEVICE_FAILURE
                response = ExceptionResponse(self._message.function_code, code)
        response.dev_id, response.transaction_id = exp_devid, exp_tid
        return len(data), response

    @contextmanager
    def _explained(self, what: str) -> Iterator[None]:
        try:
            yield
        except Exception as error:  # a plug-in of others may raise anything
            name = type(self._codec).__name__
            raise CodecError(
                f"the codec {name} could not {what} a request ({type(error).__name__}: {error})"
            ) from error


def _request_of(message: ModbusPDU) -> RegisterRequest:
    match message:
        case ReadInputRegistersRequest():
            return ReadRegisters(Kind.INPUT, message.address, message.count)
        case ReadHoldingRegistersRequest():
            return ReadRegisters(Kind.HOLDING, message.address, message.count)
        case WriteMultipleRegistersRequest():
            return WriteRegisters(message.address, tuple(message.registers))
        case WriteSingleCoilRequest():
            return WriteCoil(message.address, message.bits[0])
    raise TypeError(f"no request for registers: {message}")


def _response(message: ModbusPDU, words: list[int]) -> ModbusPDU:
    match message:
        case ReadInputRegistersRequest():
            return ReadInputRegistersResponse(registers=words)
        case ReadHoldingRegistersRequest():
            return ReadHoldingRegistersResponse(registers=words)
        case WriteMultipleRegistersRequest():
            return WriteMultipleRegistersResponse(address=message.address, count=len(message.registers))
    return WriteSingleCoilResponse(address=message.address, bits=message.bits)
