"""Maps of testers as TOML files: read, checked, and made a `TesterMap`.

`docs/examples/tester_map.toml` is one, with every table explained.
"""

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Literal, Self

from pydantic import Field, ValidationError, field_validator, model_validator

from rig.document import Document
from rig.errors import RequestError
from rig.registers import (
    HEARTBEAT,
    STATUS,
    CommandCode,
    DataType,
    Interlock,
    Kind,
    Register,
    RegisterBlock,
    State,
    Value,
)
from rig.tester.register_map import Coil, MapStep, Match, Probe, TesterMap, Write
from store.validation import FieldPath, faults_text

LARGEST_FILE = 100_000  # bytes
WIDEST_GAP = 8  # registers without a meaning here that are read with others in one transaction
WIDEST_BLOCK = 120  # registers; Modbus allows 125
ANY_VALUE = (-(2.0**63), 2.0**64)  # lowest and highest value of a register whose range is not known
UNITS: Mapping[str, tuple[str, float]] = {
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "N": ("N", 1.0),
    "kN": ("N", 1e3),
    "Hz": ("Hz", 1.0),
    "mHz": ("Hz", 1e-3),
    "": ("", 1.0),
}
"""Units of a map, and the SI unit and factor of each."""
STATUS_REGISTERS = {register.name: register for register in STATUS.registers}
NEEDED_STATUS = ("cycles", "displacement_mean", "displacement_pp", "force_mean")
"""Registers that the status of every controller has to have."""
MADE_HERE = ("state", "interlocks", "stopped_by", "refusal", "sequence", "command")
"""Values of a status that the driver makes from others, so that no register may have their names."""
SET_VALUES = ("preset", "amplitude", "frequency")
"""Values that commands set; a map has all of them."""
COMMANDS = ("hydraulics_on", "hydraulics_off", "preset", "cycle", "hold", "reset")
"""Commands that a map has to have."""
SETS = {"preset": {"preset"}, "cycle": {"amplitude", "frequency"}}
"""The set values of each command that has any."""
NEEDED_STATES = ("hydraulics_off", "held", "settled")
"""States that a map has to tell from each other."""
CODE_TYPES = ("u16", "u32")
"""Types of registers whose bits have meanings."""
StateName = Literal["hydraulics_off", "idle", "ramping", "held", "cycling", "settled", "tripped"]
InterlockName = Literal[
    "upper_displacement", "lower_displacement", "force", "error", "underpeak", "watchdog", "emergency_stop"
]
DATATYPES = {
    "u16": DataType.UINT16,
    "i16": DataType.INT16,
    "u32": DataType.UINT32,
    "i32": DataType.INT32,
    "f32": DataType.FLOAT32,
    "text16": DataType.TEXT16,
}
Address = Field(ge=0, le=0xFFFF, description="Modbus address, from 0")
WordOrder = Literal["high", "low"]


class TesterMapError(RequestError):
    """The map of a tester cannot be read, or makes no sense; nothing was sent."""


class RegisterRow(Document):
    """One quantity or code at the controller."""

    address: int = Address
    type: Literal["u16", "i16", "u32", "i32", "f32", "text16"]
    unit: Literal["m", "mm", "um", "N", "kN", "Hz", "mHz", ""] = ""
    scale: float = Field(default=1.0, description="of the number in the register, to `unit`")
    table: Literal["holding", "input"] | None = None
    first_byte: WordOrder | None = None
    first_word: WordOrder | None = None

    @field_validator("scale")
    @classmethod
    def _is_not_zero(cls, scale: float) -> float:
        if scale == 0.0:
            raise ValueError("is 0; give what one count of the register is worth")
        return scale


class IdentityRow(RegisterRow):
    """A value by which the controller is known; it is compared at connect where it has a value or a range."""

    equals: float | None = None
    minimum: float | None = None
    maximum: float | None = None


class SetRow(RegisterRow):
    """A set value."""

    read_back: bool = Field(default=True, description="whether the register can be read, and has what was written")


class MatchRow(Document):
    """A condition on a register of the status: one `bit`, or the `value` of the bits of `mask`."""

    register_: str = Field(alias="register")
    bit: int | None = Field(default=None, ge=0, le=31)
    mask: int = Field(default=0xFFFFFFFF, ge=1, le=0xFFFFFFFF)
    value: int | None = Field(default=None, ge=0, le=0xFFFFFFFF)

    @model_validator(mode="after")
    def _is_one_condition(self) -> Self:
        if (self.bit is None) == (self.value is None):
            raise ValueError("give either bit (which has to be 1) or value, with mask where only some bits count")
        if self.value is not None and self.value & ~self.mask:
            raise ValueError(f"value {self.value:#x} has bits beyond mask {self.mask:#x}, so that it never holds")
        return self

    def match(self) -> Match:
        """The condition."""
        if self.bit is not None:
            return Match(self.register_, 1 << self.bit, 1 << self.bit)
        assert self.value is not None, "checked above"
        return Match(self.register_, self.mask, self.value)


class StepRow(Document):
    """One write of a command: a set value, a register, or a coil."""

    set: Literal["preset", "amplitude", "frequency"] | None = None
    address: int | None = Field(default=None, ge=0, le=0xFFFF)
    coil: int | None = Field(default=None, ge=0, le=0xFFFF)
    value: int = Field(default=1, ge=0, le=0xFFFF)

    @model_validator(mode="after")
    def _is_one_write(self) -> Self:
        if sum(each is not None for each in (self.set, self.address, self.coil)) != 1:
            raise ValueError("give one of set, address (with value) and coil")
        return self


class HeartbeatRow(Document):
    """The register of the watchdog: it has to change within `watchdog_time`."""

    address: int = Address
    watchdog_time: float = Field(ge=0.1, le=10.0, description="s, as it is set at the controller")


class LimitRows(Document):
    """The controller's own limits on commands, as they are set there; SI units."""

    amplitude_limit: float | None = Field(default=None, gt=0)
    frequency_limit: float | None = Field(default=None, gt=0)
    velocity_limit: float | None = Field(default=None, gt=0)
    acceleration_limit: float | None = Field(default=None, gt=0)


class MapDocument(Document):
    """A tester's map."""

    name: str = Field(min_length=1, max_length=100)
    response_time: float = Field(ge=0.0, le=0.3, description="s until a status shows a command")
    preset_tolerance: float = Field(gt=0.0, le=1e-4, description="m, within which a preset is reached")
    table: Literal["holding", "input"] = "holding"
    first_byte: WordOrder = "high"
    first_word: WordOrder = "high"
    identity: dict[str, IdentityRow]
    limits: LimitRows = LimitRows()
    status: dict[str, RegisterRow]
    states: dict[StateName, MatchRow]
    interlocks: dict[InterlockName, MatchRow] = Field(default_factory=dict)
    set: dict[str, SetRow]
    commands: dict[str, list[StepRow]]
    emergency_stop: tuple[StepRow, ...] = ()
    heartbeat: HeartbeatRow | None = None

    @field_validator("identity")
    @classmethod
    def _is_known_by_something(cls, rows: dict[str, IdentityRow]) -> dict[str, IdentityRow]:
        if all(row.equals is None and row.minimum is None and row.maximum is None for row in rows.values()):
            raise ValueError("no register has equals, minimum or maximum; another controller would not be noticed")
        return rows

    @field_validator("status")
    @classmethod
    def _has_what_is_measured(cls, rows: dict[str, RegisterRow]) -> dict[str, RegisterRow]:
        _check_names(rows, NEEDED_STATUS, None)
        for name, row in rows.items():
            if name in MADE_HERE:
                raise ValueError(
                    f"{name} is made by [states], [interlocks] and the driver; name the register otherwise"
                )
            _check_unit(name, row)
            if name not in STATUS_REGISTERS and row.type not in CODE_TYPES:
                raise ValueError(f"{name} is no quantity that the driver knows, so that it is a code: type u16 or u32")
        return rows

    @field_validator("states")
    @classmethod
    def _tells_motion_from_rest(cls, rows: dict[StateName, MatchRow]) -> dict[StateName, MatchRow]:
        _check_names(rows, NEEDED_STATES, None)
        return rows

    @field_validator("set")
    @classmethod
    def _has_all_set_values(cls, rows: dict[str, SetRow]) -> dict[str, SetRow]:
        _check_names(rows, SET_VALUES, SET_VALUES)
        for name, row in rows.items():
            _check_unit(name, row)
            if row.table == "input":
                raise ValueError(f"{name} is written, so that its table is holding")
        return rows

    @field_validator("commands")
    @classmethod
    def _has_all_commands(cls, rows: dict[str, list[StepRow]]) -> dict[str, list[StepRow]]:
        _check_names(rows, COMMANDS, COMMANDS)
        for name, steps in rows.items():
            given, needed = {step.set for step in steps if step.set is not None}, SETS.get(name, set())
            if given != needed:
                said, wanted = (", ".join(sorted(each)) or "nothing" for each in (given, needed))
                raise ValueError(f"{name} sets {said}; it has to set {wanted}")
            if not steps or steps[-1].set is not None:
                raise ValueError(f"{name} has to end with an address or a coil that carries it out")
        if rows["hold"] == rows["hydraulics_on"]:
            raise ValueError(
                "hold writes what hydraulics_on writes, and would switch them on; write what stops motion alone, or "
                "what hydraulics_off writes"
            )
        return rows

    @field_validator("emergency_stop")
    @classmethod
    def _sets_nothing(cls, steps: tuple[StepRow, ...]) -> tuple[StepRow, ...]:
        for step in steps:
            if step.set is not None:
                raise ValueError(f"sets {step.set}, and an emergency stop has no set value; give an address or a coil")
        return steps

    @model_validator(mode="after")
    def _conditions_can_hold(self) -> Self:
        for name, row in (*self.states.items(), *self.interlocks.items()):
            if row.register_ not in self.status or self.status[row.register_].type not in CODE_TYPES:
                raise ValueError(f"{name} looks at {row.register_}, which is no register of type u16 or u32 in status")
            bits = 16 * DATATYPES[self.status[row.register_].type].words
            if row.match().value >> bits:
                raise ValueError(f"{name} looks at bits beyond the {bits} of {row.register_}, so that it never holds")
        return self


def read_tester_map(path: Path) -> TesterMap:
    """The map in a TOML file.

    Raises TesterMapError where it cannot be read or makes no sense; the message has the line of each fault.
    """
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise TesterMapError(f"tester map {path} cannot be read: {error.strerror or error}") from error
    if len(content) > LARGEST_FILE:
        raise TesterMapError(f"tester map {path} has more than {LARGEST_FILE} bytes")
    try:
        text = content.decode("utf-8")
        document = MapDocument.model_validate(tomllib.loads(text))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise TesterMapError(f"tester map {path} is not valid TOML: {error}") from error
    except ValidationError as error:
        faults = faults_text(error.errors(), "map", lambda place: line_of(text, place))
        raise TesterMapError(f"tester map {path}: {faults}") from error
    return tester_map(document)


def tester_map(document: MapDocument) -> TesterMap:
    """The map that a document describes."""
    stated: dict[str, Value] = {name: value for name, value in document.limits if value is not None}
    heartbeat = None
    if document.heartbeat is not None:
        stated["watchdog_time"] = document.heartbeat.watchdog_time
        heartbeat = RegisterBlock(
            HEARTBEAT.name, Kind.HOLDING, document.heartbeat.address, HEARTBEAT.registers, checked=False
        )
    return TesterMap(
        name=document.name,
        identity=_blocks(document, "identity", document.identity),
        detectors=(),
        status=_blocks(document, "status", document.status),
        commands={CommandCode[name.upper()]: _steps(document, steps) for name, steps in document.commands.items()},
        emergency_stop=_steps(document, document.emergency_stop),
        heartbeat=heartbeat,
        probes=tuple(_probes(document.identity)),
        states=tuple((row.match(), State[name.upper()]) for name, row in document.states.items()),
        interlocks=tuple((row.match(), Interlock[name.upper()]) for name, row in document.interlocks.items()),
        stated=stated,
        response_time=document.response_time,
        preset_tolerance=document.preset_tolerance,
    )


def line_of(text: str, place: FieldPath) -> str:
    """The line of a place in a TOML text as far as it is found, as text such as "line 12, "; empty for the whole."""
    keys = [str(key) for key in place if isinstance(key, str)]
    table, found, deepest = list[str](), 0, 0
    for number, line in enumerate(text.splitlines(), start=1):
        if header := re.match(r"\s*\[+\s*([^\]]+?)\s*\]+", line):
            here = table = [part.strip(" \"'") for part in header[1].split(".")]
        elif pair := re.match(r"\s*([\w.\-\"']+)\s*=", line):
            here = [*table, *(part.strip("\"'") for part in pair[1].split("."))]
        else:
            continue
        common = next((at for at, (one, key) in enumerate(zip(here, keys, strict=False)) if one != key), None)
        depth = min(len(here), len(keys)) if common is None else common
        if depth > deepest:
            found, deepest = number, depth
    return f"line {found}, " if found else ""


def _check_names(rows: Iterable[str], needed: Iterable[str], known: Iterable[str] | None) -> None:
    given = set(rows)
    if missing := sorted(set(needed) - given):
        raise ValueError(f"has no {', '.join(missing)}; the driver needs it")
    if known is not None and (strange := sorted(given - set(known))):
        raise ValueError(f"has {', '.join(strange)}, which is none of {', '.join(known)}")


def _check_unit(name: str, row: RegisterRow) -> None:
    wanted = STATUS_REGISTERS[name].unit if name in STATUS_REGISTERS else ""
    if UNITS[row.unit][0] != wanted:
        units = ", ".join(unit for unit, (si, _) in UNITS.items() if si == wanted) or "none"
        raise ValueError(f"{name} has unit {row.unit or 'none'}; it has to be one of {units}")


def _register(document: MapDocument, name: str, row: RegisterRow) -> Register:
    known = STATUS_REGISTERS.get(name)
    si, factor = UNITS[row.unit]
    lowest, highest = ANY_VALUE if known is None else (known.minimum, known.maximum)
    return Register(
        name,
        DATATYPES[row.type],
        si,
        "",
        lowest,
        highest,
        scale=row.scale * factor,
        low_byte_first=(row.first_byte or document.first_byte) == "low",
        low_word_first=(row.first_word or document.first_word) == "low",
    )


def _blocks(document: MapDocument, what: str, rows: Mapping[str, RegisterRow]) -> tuple[RegisterBlock, ...]:
    """The smallest number of blocks that hold these registers, with the unused registers between them."""
    kinds = (Kind.HOLDING, Kind.INPUT)
    return tuple(block for kind in kinds for block in _merged(what, kind, _sorted(document, rows, kind)))


def _sorted(document: MapDocument, rows: Mapping[str, RegisterRow], kind: Kind) -> list[tuple[int, Register]]:
    found = [
        (row.address, _register(document, name, row))
        for name, row in rows.items()
        if Kind(f"{row.table or document.table} register") is kind
    ]
    return sorted(found, key=lambda each: each[0])


def _merged(what: str, kind: Kind, placed: list[tuple[int, Register]]) -> Iterator[RegisterBlock]:
    begin, end, registers = 0, 0, list[Register]()
    for address, register in placed:
        if registers and address < end:
            raise TesterMapError(f"register {register.name} of {what} begins at {address}, within {registers[-1].name}")
        if registers and (address - end > WIDEST_GAP or address + register.words - begin > WIDEST_BLOCK):
            yield RegisterBlock(what.upper(), kind, begin, tuple(registers), checked=False)
            registers = []
        if not registers:
            begin = end = address
        registers += [Register(f"unused {each}", DataType.UINT16, "", "") for each in range(end, address)]
        registers.append(register)
        end = address + register.words
    if registers:
        yield RegisterBlock(what.upper(), kind, begin, tuple(registers), checked=False)


def _steps(document: MapDocument, rows: Iterable[StepRow]) -> tuple[MapStep, ...]:
    return tuple(_step(document, row) for row in rows)


def _step(document: MapDocument, row: StepRow) -> MapStep:
    if row.coil is not None:
        return Coil(row.coil, bool(row.value))
    if row.set is not None:
        given = document.set[row.set]
        block = RegisterBlock("SET", Kind.HOLDING, given.address, (_register(document, row.set, given),), checked=False)
        return Write(block, read_back=given.read_back)
    assert row.address is not None, "it was checked"
    low = document.first_byte == "low"
    register = Register("command", DataType.UINT16, "", "", low_byte_first=low)
    return Write(
        RegisterBlock("COMMAND", Kind.HOLDING, row.address, (register,), checked=False), {"command": row.value}
    )


def _probes(rows: Mapping[str, IdentityRow]) -> Iterator[Probe]:
    for name, row in rows.items():
        lowest = row.equals if row.equals is not None else row.minimum
        highest = row.equals if row.equals is not None else row.maximum
        if lowest is None and highest is None:
            continue
        low, high = (ANY_VALUE[0] if lowest is None else lowest), (ANY_VALUE[1] if highest is None else highest)
        wanted = f"{low:g}" if low == high else f"{low:g} to {high:g}"
        yield Probe(
            name, low, high, f"has {name} {{found}}, its map {wanted}: it is another controller, or the map is wrong"
        )
