"""The elastomer tester's wire contract: its Modbus register map, as a table.

The map is a set of blocks. A block is a run of registers that is read or written in one transaction and ends with a
CRC-16 of the words before it, because Modbus TCP carries no checksum of its own: a block with a flipped bit is refused,
never half applied. All quantities are in SI units; 32-bit values are big-endian, high word first.

    IDENTITY   input    what the instrument is, and the limits on commands that live in it
    DETECTORS  input    the limit detectors as they are in force: limit and action of each
    STATUS     input    state, interlocks, the command last applied, and what is measured now
    HEARTBEAT  holding  a counter that has to change within the watchdog time while hydraulics are on
    COMMAND    holding  one command with its sequence number, written whole
    EMERGENCY_STOP  coil  writing 1 trips the emergency stop, at any time, without sequence number

Limits, watchdog time and detectors are set at the instrument. The network may tighten a detector, never loosen it.
"""

import struct
from binascii import crc_hqx
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum, IntFlag, StrEnum
from functools import reduce
from operator import or_

MAP_VERSION = 2
CYCLES_REPORTED = 16
"""Number of latest complete cycles that STATUS reports one by one."""

Value = int | float | str | tuple[float, ...]


class Units(IntEnum):
    """The system of units of every quantity in the map."""

    SI = 1
    MILLIMETRE_NEWTON = 2


class State(IntEnum):
    """State of the actuator."""

    HYDRAULICS_OFF = 0
    IDLE = 1  # hydraulics on, no preset yet
    RAMPING = 2  # on the way to the preset or to rest
    HELD = 3  # at the preset, at rest
    CYCLING = 4  # amplitude still approaching what was commanded
    SETTLED = 5  # cycling steadily
    TRIPPED = 6  # an interlock stopped the actuator; needs a reset


class Interlock(IntFlag):
    """Limit detectors and other reasons to stop; a bit stays set until it is reset."""

    UPPER_DISPLACEMENT = 1
    LOWER_DISPLACEMENT = 2
    FORCE = 4
    ERROR = 8
    UNDERPEAK = 16
    WATCHDOG = 32
    EMERGENCY_STOP = 64


NO_INTERLOCK = Interlock(0)


class Action(IntEnum):
    """Action of the instrument when a detector fires, from the mildest to the hardest; each includes the one before."""

    INDICATE = 1  # the interlock's bit is set
    HOLD = 2  # cycling and ramping stop; the preset stays in force, and a command goes on from there
    STOP = 3  # the preset is withdrawn; the program begins again with one
    PROGRAM_INTERLOCK = 4  # nothing moves before a reset
    HYDRAULIC_INTERLOCK = 5  # hydraulics go off


DETECTED = (
    Interlock.UPPER_DISPLACEMENT,
    Interlock.LOWER_DISPLACEMENT,
    Interlock.FORCE,
    Interlock.ERROR,
    Interlock.UNDERPEAK,
)
"""Interlocks with a limit detector, whose limit and action are set; the others are always hydraulic interlocks."""


def name_of(interlock: Interlock) -> str:
    """Name of one interlock in the map: ``upper_displacement``."""
    return str(interlock.name).lower()


def interlock_names(interlocks: Interlock) -> tuple[str, ...]:
    """Name in the map of each of `interlocks`."""
    return tuple(name_of(each) for each in interlocks)


def interlocks_named(names: Iterable[str]) -> Interlock:
    """The interlocks with these names in the map. Raises KeyError for a name that it does not have."""
    known = {name_of(each): each for each in Interlock}
    return reduce(or_, (known[name] for name in names), NO_INTERLOCK)


class CommandCode(IntEnum):
    """The command of a COMMAND block."""

    NONE = 0
    HYDRAULICS_ON = 1
    HYDRAULICS_OFF = 2
    PRESET = 3  # ramp to `preset` and hold
    CYCLE = 4  # cycle about the preset with `amplitude` and `frequency`
    HOLD = 5  # stop cycling or ramping and hold the mean position
    RESET = 6  # clear the interlocks, once their cause is gone
    DETECTOR = 7  # set `limit` and `action` of `detector`, as tight as at the instrument or tighter


class Refusal(IntEnum):
    """Why the instrument refused the last COMMAND; it then also answers with a Modbus exception."""

    NONE = 0
    CHECKSUM = 1
    UNKNOWN_COMMAND = 2
    STALE_SEQUENCE = 3  # used before, or older than the last one: a command that was delayed on the way
    PRESET_LIMIT = 4
    AMPLITUDE_LIMIT = 5
    FREQUENCY_LIMIT = 6
    VELOCITY_LIMIT = 7
    ACCELERATION_LIMIT = 8
    DISPLACEMENT_LIMIT = 9
    HYDRAULICS_ARE_OFF = 10
    NOT_AT_PRESET = 11
    TRIPPED = 12
    CAUSE_STILL_PRESENT = 13
    BUSY = 14
    FAULT = 15
    DETECTOR_LIMIT = 16  # no such detector or action, or looser than at the instrument


class Kind(StrEnum):
    """The Modbus table of a register."""

    COIL = "coil"
    INPUT = "input register"
    HOLDING = "holding register"


class DataType(Enum):
    """Layout of a value in registers, as its `struct` format, big-endian."""

    UINT16 = ">H"
    INT16 = ">h"
    UINT32 = ">I"
    INT32 = ">i"
    FLOAT32 = ">f"
    TEXT16 = ">16s"

    @property
    def words(self) -> int:
        """Number of 16-bit registers that one value takes."""
        return struct.calcsize(self.value) // 2


@dataclass(frozen=True)
class Register:
    """One quantity of a block; its address follows from its place in the block.

    Attributes:
        name: key of the value in the arguments of `RegisterBlock.pack` and the result of `RegisterBlock.unpack`.
        datatype: how the value is laid out.
        unit: SI unit, empty where the value is a code, a count or a text.
        meaning: one phrase for readers of the map.
        minimum: smallest value with a meaning, in `unit`.
        maximum: largest value with a meaning, in `unit`.
        count: number of values; a value with more than one is a tuple of floats.
        scale: of a number in the register, to the value in `unit`.
        low_byte_first, low_word_first: order within a word, and of the two words of a value; both high first here.
    """

    name: str
    datatype: DataType
    unit: str
    meaning: str
    minimum: float = 0.0
    maximum: float = 65535.0
    count: int = 1
    scale: float = 1.0
    low_byte_first: bool = False
    low_word_first: bool = False

    @property
    def words(self) -> int:
        """Number of 16-bit registers taken."""
        return self.datatype.words * self.count


class ChecksumError(ValueError):
    """The words of a block do not agree with their CRC-16: at least one bit was changed on the way."""


@dataclass(frozen=True)
class RegisterBlock:
    """A run of registers that is read or written whole, closed by a CRC-16 where it is `checked`, as all here are."""

    name: str
    kind: Kind
    address: int
    registers: tuple[Register, ...]
    checked: bool = True

    @property
    def writable(self) -> bool:
        """Whether the network may write it (whole)."""
        return self.kind is Kind.HOLDING

    @property
    def count(self) -> int:
        """Number of 16-bit registers, the checksum included."""
        return sum(register.words for register in self.registers) + self.checked

    def address_of(self, name: str) -> int:
        """Modbus address (from 0) of the first word of register `name`.

        Raises KeyError where the block has no such register.
        """
        address = self.address
        for register in self.registers:
            if register.name == name:
                return address
            address += register.words
        raise KeyError(name)

    def range_of(self, name: str) -> tuple[float, float]:
        """Smallest and largest value of register `name` with a meaning. Raises KeyError where there is none."""
        found = {register.name: register for register in self.registers}[name]
        return found.minimum, found.maximum

    def pack(self, values: Mapping[str, Value]) -> list[int]:
        """Words to send for `values`, which names every register of the block; the checksum is added.

        Raises:
            KeyError: a register has no value.
            struct.error: a value does not fit its data type.
        """
        words = [word for register in self.registers for word in _encode(register, values[register.name])]
        return [*words, checksum(words)] if self.checked else words

    def out_of_range(self, values: Mapping[str, Value]) -> list[str]:
        """The `values` outside the range that the map gives their register, as texts, each once; nan is outside."""
        found = []
        for register in self.registers:
            value = values.get(register.name, "")
            if isinstance(value, str):
                continue
            allowed = f"{register.minimum:g} to {register.maximum:g} {register.unit}".strip()
            found += [
                f"{register.name.replace('_', ' ')} {each:g}, outside {allowed}"
                for each in (value if isinstance(value, tuple) else (value,))
                if not float32(register.minimum) <= each <= float32(register.maximum)
            ]
        return list(dict.fromkeys(found))

    def unpack(self, words: Sequence[int]) -> dict[str, Value]:
        """Values by register name, from the words of the whole block.

        Raises ChecksumError where the number of words or the checksum is wrong.
        """
        if len(words) != self.count:
            raise ChecksumError(f"block {self.name} has {self.count} words, {len(words)} came")
        if self.checked and checksum(words[:-1]) != words[-1]:
            raise ChecksumError(f"block {self.name} came with checksum {words[-1]:#06x}, its words give another")
        values, start = dict[str, Value](), 0
        for register in self.registers:
            values[register.name] = _decode(register, words[start : start + register.words])
            start += register.words
        return values


def is_newer(sequence: int, last: int) -> bool:
    """Whether `sequence` comes after `last`. Numbers begin again after 65535; the next 32767 count as after."""
    return 0 < (sequence - last) % 0x10000 < 0x8000


def checksum(words: Sequence[int]) -> int:
    """CRC-16 (CCITT polynomial, start value 0xFFFF) of 16-bit words, high byte first."""
    return crc_hqx(struct.pack(f">{len(words)}H", *words), 0xFFFF)


def float32(value: float) -> float:
    """The number that a FLOAT32 register holds for `value`; a read-back has to equal it."""
    return float(struct.unpack(">f", struct.pack(">f", value))[0])


def _encode(register: Register, value: Value) -> list[int]:
    items: Sequence[Value] = value if isinstance(value, tuple) else (value,)
    if len(items) != register.count:
        raise struct.error(f"register {register.name} holds {register.count} values, not {len(items)}")
    data = b"".join(struct.pack(register.datatype.value, _counts(register, item)) for item in items)
    return _ordered(register, struct.unpack(f">{register.words}H", data))


def _counts(register: Register, item: Value) -> object:
    """The number or bytes in the register that stand for `item`."""
    if isinstance(item, str):
        return item.encode("ascii")
    if register.scale == 1.0 or isinstance(item, tuple):
        return item
    return item / register.scale if register.datatype is DataType.FLOAT32 else round(item / register.scale)


def _decode(register: Register, words: Sequence[int]) -> Value:
    data = struct.pack(f">{len(words)}H", *_ordered(register, words))
    items = [item for (item,) in struct.iter_unpack(register.datatype.value, data)]
    if register.datatype is DataType.TEXT16:
        return str(items[0].rstrip(b"\0").decode("ascii", errors="replace"))
    if register.scale != 1.0:
        items = [register.scale * item for item in items]
    if register.count > 1:
        return tuple(items)
    value: int | float = items[0]
    return value


def _ordered(register: Register, words: Sequence[int]) -> list[int]:
    """Words of the wire with the high byte and the high word first, or the other way round."""
    size = register.datatype.words
    if register.low_word_first:
        words = [word for start in range(0, len(words), size) for word in reversed(words[start : start + size])]
    return [(word & 0xFF) << 8 | word >> 8 for word in words] if register.low_byte_first else list(words)


_U16, _U32, _F32, _TEXT = DataType.UINT16, DataType.UINT32, DataType.FLOAT32, DataType.TEXT16

IDENTITY = RegisterBlock(
    "IDENTITY",
    Kind.INPUT,
    0,
    (
        Register("map_version", _U16, "", "version of this map", 1),
        Register("units", _U16, "", "code of Units", 1, 2),
        Register("serial", _TEXT, "", "serial number of the instrument, ASCII"),
        Register("watchdog_time", _F32, "s", "longest time between two heartbeats with hydraulics on", 0.1, 10.0),
        Register("amplitude_limit", _F32, "m", "largest peak-to-peak amplitude", 1e-6, 0.01),
        Register("frequency_limit", _F32, "Hz", "highest frequency", 1.0, 1000.0),
        Register("velocity_limit", _F32, "m/s", "highest velocity of a cycle", 1e-3, 1.0),
        Register("acceleration_limit", _F32, "m/s^2", "highest acceleration of a cycle", 0.1, 1000.0),
    ),
)

_DETECTOR_LIMITS = (
    ("m", "highest position of the actuator", -0.01, 0.01),
    ("m", "lowest position of the actuator", -0.01, 0.01),
    ("N", "largest absolute force", 1.0, 25e3),
    ("m", "largest overshoot of the peak-to-peak amplitude beyond the command", 1e-6, 0.01),
    ("", "smallest settled amplitude as a fraction of the command", 0.0, 1.0),
)

DETECTORS = RegisterBlock(
    "DETECTORS",
    Kind.INPUT,
    60,
    tuple(
        register
        for interlock, (unit, meaning, lowest, highest) in zip(DETECTED, _DETECTOR_LIMITS, strict=True)
        for register in (
            Register(f"{name_of(interlock)}_limit", _F32, unit, meaning, lowest, highest),
            Register(f"{name_of(interlock)}_action", _U16, "", "code of Action when it fires", 1, 5),
        )
    ),
)

STATUS = RegisterBlock(
    "STATUS",
    Kind.INPUT,
    100,
    (
        Register("state", _U16, "", "code of State", 0, 6),
        Register("interlocks", _U16, "", "bits of Interlock that fired since the last reset", 0, 127),
        Register("stopped_by", _U16, "", "those of them that stopped the actuator, by any action but indicate", 0, 127),
        Register("refusal", _U16, "", "code of Refusal of the last command, 0 where it was applied", 0, 16),
        Register("heartbeat", _U16, "", "the last heartbeat counter received"),
        Register("sequence", _U16, "", "sequence number of the last command applied"),
        Register("command", _U16, "", "code of the last command applied", 0, 7),
        Register("preset", _F32, "m", "preset in force", -0.01, 0.01),
        Register("amplitude", _F32, "m", "commanded peak-to-peak amplitude in force, 0 when not cycling", 0.0, 0.01),
        Register("frequency", _F32, "Hz", "frequency in force, 0 when not cycling", 0.0, 1000.0),
        Register("cycles", _U32, "", "complete cycles since the last change of command", 0, 2**32 - 1),
        Register("displacement_mean", _F32, "m", "mean position of the actuator", -0.01, 0.01),
        Register("force_mean", _F32, "N", "mean force", -25e3, 25e3),
        Register("force_pp", _F32, "N", "peak-to-peak force of the last complete cycle", 0.0, 50e3),
        Register(
            "displacement_pp",
            _F32,
            "m",
            "peak-to-peak displacement of the latest complete cycles, latest first, 0 where there is none yet",
            0.0,
            0.02,
            count=CYCLES_REPORTED,
        ),
    ),
)

HEARTBEAT = RegisterBlock(
    "HEARTBEAT",
    Kind.HOLDING,
    200,
    (Register("heartbeat", _U16, "", "a counter; a value that did not change is no heartbeat"),),
)

COMMAND = RegisterBlock(
    "COMMAND",
    Kind.HOLDING,
    210,
    (
        Register("command", _U16, "", "code of CommandCode", 0, 7),
        Register(
            "sequence", _U16, "", "above the last one (modulo 65536); the same command again is not applied again"
        ),
        Register("preset", _F32, "m", "mean position asked for by PRESET", -0.01, 0.01),
        Register("amplitude", _F32, "m", "peak-to-peak amplitude asked for by CYCLE", 0.0, 0.01),
        Register("frequency", _F32, "Hz", "frequency asked for by CYCLE", 0.0, 1000.0),
        Register("detector", _U16, "", "bit of Interlock that DETECTOR sets", 0, 16),
        Register("action", _U16, "", "code of Action that DETECTOR sets", 0, 5),
        Register("limit", _F32, "", "limit that DETECTOR sets, in the unit of that detector", -0.01, 25e3),
    ),
)

EMERGENCY_STOP_COIL = 0
BLOCKS = (IDENTITY, DETECTORS, STATUS, HEARTBEAT, COMMAND)
