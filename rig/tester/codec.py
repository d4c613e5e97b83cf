"""Controllers with another protocol than Modbus: a codec turns requests for registers into the bytes of their line.

A codec only translates. It has no line, clock or thread. `rig.tester.modbus.ModbusLink` opens the line, checks STOP
immediately before the bytes of a command go out, limits the time of each reply and lets a stop overtake. So a codec
sends nothing by itself. Where a codec fails or hangs, STOP still latches and the watchdog still acts. Map, limits,
heartbeat and halting are the same as for every other tester.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from rig.registers import Kind


@dataclass(frozen=True)
class ReadRegisters:
    """Read `count` registers of the table `kind` from `address`."""

    kind: Kind
    address: int
    count: int


@dataclass(frozen=True)
class WriteRegisters:
    """Write `words`, 16 bits each, to the holding registers from `address`, all of them or none."""

    address: int
    words: tuple[int, ...]


@dataclass(frozen=True)
class WriteCoil:
    """Write one bit."""

    address: int
    value: bool


RegisterRequest = ReadRegisters | WriteRegisters | WriteCoil


class RegisterRefusedError(Exception):
    """The reply is a refusal; raised by `decode`. `busy`: the controller only wants the request again, later."""

    def __init__(self, why: str, *, busy: bool = False) -> None:
        super().__init__(why)
        self.busy = busy


class TesterCodec(Protocol):
    """One protocol. It keeps nothing between two calls: several lines share it, any thread may call it.

    An exception of any other kind than `RegisterRefusedError` is a reply that makes no sense.
    """

    def encode(self, request: RegisterRequest) -> bytes:
        """The bytes of `request`, whole."""

    def decode(self, request: RegisterRequest, received: bytes) -> Sequence[int] | None:
        """The words that answer a read, none for a write; None where `received` is the beginning of a reply only.

        `received` is what came since `request` was sent. Check whatever tells this reply from that to another request.
        """
