"""The map of a tester's controller: its registers, its codes, what each command writes, and what it lacks.

The driver thinks in the words of `rig.registers`. A map translates between these and a controller, so that one driver
serves all. `OURS` is the map of `rig.registers` itself; `rig.tester.register_map_file` reads others.
"""

import math
import threading
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import cast

from rig.registers import (
    COMMAND,
    CYCLES_REPORTED,
    DETECTORS,
    EMERGENCY_STOP_COIL,
    HEARTBEAT,
    IDENTITY,
    MAP_VERSION,
    NO_INTERLOCK,
    STATUS,
    CommandCode,
    DataType,
    Interlock,
    RegisterBlock,
    State,
    Units,
    Value,
)
from rig.tester.codec import TesterCodec
from rig.tester.missing_functions import Lack
from rig.tester.status import CYCLING, ImplausibleStatusError, StatusFault


@dataclass(frozen=True)
class Match:
    """A condition on a register of a status: it holds where the bits of `mask` are `value`."""

    register: str
    mask: int
    value: int

    def holds(self, values: Mapping[str, Value]) -> bool:
        """Whether the condition holds for the values of a status. Raises KeyError where the register is not in them."""
        return cast(int, values[self.register]) & self.mask == self.value


@dataclass(frozen=True)
class Write:
    """A block that is written in one transaction.

    Attributes:
        block: what is written.
        constants: its values that are not those asked for.
        read_back: whether it is read again and compared before anything else is written.
    """

    block: RegisterBlock
    constants: Mapping[str, Value] = field(default_factory=dict)
    read_back: bool = False


@dataclass(frozen=True)
class Coil:
    """A coil that is written."""

    address: int
    value: bool = True


MapStep = Write | Coil


@dataclass(frozen=True)
class Probe:
    """A register that shows whether this is the right controller.

    Attributes:
        name: of the register.
        lowest, highest: range in which its value has to be.
        message: what is wrong where it is not; ``{found}`` stands for its value.
    """

    name: str
    lowest: float
    highest: float
    message: str

    def fault(self, found: Mapping[str, Value]) -> str:
        """The fault in the values of the identity; empty if there is none."""
        value = found[self.name]
        holds = not isinstance(value, str | tuple) and self.lowest <= value <= self.highest
        return "" if holds else self.message.format(found=value)


@dataclass(frozen=True)
class TesterMap:
    """The registers of one kind of controller.

    Attributes:
        name: for people.
        identity: blocks that say what the instrument is; their registers are those of IDENTITY and of `probes`.
        detectors: blocks with the registers of DETECTORS; empty where detectors cannot be read.
        status: blocks with registers of STATUS, and those that `states` and `interlocks` look at.
        commands: what is written for each command, in this order; repeating it has to be harmless.
        emergency_stop: what is written to trip the emergency stop; empty where that is not possible over the network.
        heartbeat: the block of the heartbeat; None where there is no watchdog.
        probes: checked when the tester is connected.
        states: conditions and their states; the first that holds counts. Empty where `state` is a register.
        interlocks: conditions and their interlocks; all that hold count. Empty where `interlocks` is a register.
        stated: values of IDENTITY that stand in the map because the controller does not report them.
        response_time: s until a status shows what was commanded.
        preset_tolerance: m; a preset is reached where the mean position is as close as this.
        codec: puts requests for these registers on a line that is not Modbus; None: Modbus.
    """

    name: str
    identity: tuple[RegisterBlock, ...]
    detectors: tuple[RegisterBlock, ...]
    status: tuple[RegisterBlock, ...]
    commands: Mapping[CommandCode, tuple[MapStep, ...]]
    emergency_stop: tuple[MapStep, ...]
    heartbeat: RegisterBlock | None
    probes: tuple[Probe, ...]
    states: tuple[tuple[Match, State], ...] = ()
    interlocks: tuple[tuple[Match, Interlock], ...] = ()
    stated: Mapping[str, Value] = field(default_factory=dict)
    response_time: float = 0.0
    preset_tolerance: float = 0.0
    codec: TesterCodec | None = None

    @property
    def numbers_commands(self) -> bool:
        """Whether a status has the number of the last command."""
        return "sequence" in _names(self.status)

    @property
    def shows_heartbeat(self) -> bool:
        """Whether a status has the last heartbeat."""
        return "heartbeat" in _names(self.status)

    def shows(self, interlock: Interlock) -> bool:
        """Whether a status names this interlock where it has tripped."""
        return "interlocks" in _names(self.status) or interlock in {known for _, known in self.interlocks}

    @property
    def lacks(self) -> frozenset[Lack]:
        """The functions that the controller does not have."""
        status = _names(self.status)
        writes = [step for steps in self.commands.values() for step in steps if isinstance(step, Write)]
        blocks = [*self.identity, *self.detectors, *self.status, *(write.block for write in writes)]
        unread = [write for write in writes if set(write.constants) < _names([write.block]) and not write.read_back]
        limits = {register.name for register in IDENTITY.registers if register.name.endswith("_limit")}
        has = {
            Lack.WATCHDOG: self.heartbeat is not None,
            Lack.EMERGENCY_STOP: bool(self.emergency_stop),
            Lack.COMMAND_NUMBERS: self.numbers_commands,
            Lack.VALUES_IN_FORCE: {"amplitude", "frequency"} <= status,
            Lack.READ_BACK: self.numbers_commands or not unread,
            Lack.STATUS_AGE: self.shows_heartbeat,
            Lack.CHECKSUM: all(block.checked for block in blocks),
            Lack.INTERLOCKS: bool(self.interlocks) or "interlocks" in status,
            Lack.DETECTORS: bool(self.detectors),
            Lack.LIMITS: limits <= _names(self.identity) | set(self.stated),
            Lack.FORCE_SWING: "force_pp" in status,
        }
        return frozenset(lack for lack, present in has.items() if not present)

    def translated(self, values: Mapping[str, Value]) -> dict[str, Value]:
        """The values of a status with its state and interlocks in the words of `rig.registers`.

        Raises ImplausibleStatusError where no state of the map holds.
        """
        found = dict(values)
        if self.states:
            state = next((state for match, state in self.states if match.holds(values)), None)
            if state is None:
                looked_at = sorted({match.register for match, _ in self.states})
                shown = ", ".join(f"{name} {cast(int, values[name]):#06x}" for name in looked_at)
                raise ImplausibleStatusError(StatusFault.RANGE, f"no state of its map has {shown}")
            found["state"] = state
        if "interlocks" not in found:
            fired = NO_INTERLOCK
            for match, interlock in self.interlocks:
                fired |= interlock if match.holds(values) else NO_INTERLOCK
            found["interlocks"] = fired
        return {"stopped_by": found["interlocks"], **found}

    def agrees(self, name: str, sent: float, found: float) -> bool:
        """Whether the value of a status is the one sent, by as much as its register can tell."""
        register = next(each for block in self.status for each in block.registers if each.name == name)
        if register.datatype is not DataType.FLOAT32:
            return abs(found - sent) <= 0.51 * register.scale
        return math.isclose(found, sent, rel_tol=1e-5, abs_tol=1e-12)


def _names(blocks: Iterable[RegisterBlock]) -> set[str]:
    return {register.name for block in blocks for register in block.registers}


@dataclass(frozen=True)
class Confirmed:
    """The last command that was confirmed: its number here, what it was, the values asked for and those in force."""

    number: int = 0
    code: CommandCode = CommandCode.NONE
    asked: Mapping[str, float] = field(default_factory=dict)
    in_force: Mapping[str, float] = field(default_factory=dict)
    at: float = -math.inf
    """s of `time.monotonic`"""


class CycleHistory:
    """The amplitudes of the latest cycles since a command, for a controller that reports only the last one."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._number = -1
        self._counted = 0.0
        self._changes = 0
        self._latest = deque[float](maxlen=CYCLES_REPORTED)

    def add(self, number: int, cycles: float, amplitude_pp: float) -> tuple[float, ...]:
        """Note the last cycle of a status; returns those that began after command `number`, latest first."""
        with self._lock:
            if number != self._number:
                self._number, self._counted, self._changes = number, cycles, 0
                self._latest.clear()
            if cycles != self._counted:
                self._counted = cycles
                self._changes += 1
                if self._changes >= 2:  # the first may have begun before the command
                    self._latest.appendleft(amplitude_pp)
            return tuple(self._latest)


class StatusMemory:
    """Adds what a controller does not report to its statuses, from what this client knows. Any thread may call it."""

    def __init__(self, tester_map: TesterMap) -> None:
        self._map = tester_map
        self._cycles = CycleHistory()
        self._is_whole = {register.name for register in STATUS.registers} <= _names(tester_map.status)

    def completed(self, values: Mapping[str, Value], last: Confirmed, now: float) -> dict[str, Value]:
        """All values of STATUS.

        Args:
            values: of the status blocks of the map.
            last: the last command that was confirmed before the status was requested.
            now: when the status was requested, s of `time.monotonic`.

        Raises:
            ImplausibleStatusError: no state of the map holds.
        """
        found = self._map.translated(values)
        if self._is_whole:
            return found
        state = State(cast(int, found["state"]))
        mean, latest_pp = cast(float, found["displacement_mean"]), cast(float, found["displacement_pp"])
        if state is State.HELD and last.code is CommandCode.PRESET:
            reached = abs(mean - last.asked["preset"]) <= self._map.preset_tolerance
            state = State.HELD if reached else State.RAMPING
        cycles: tuple[float, ...] = ()
        if last.code is CommandCode.CYCLE and now > last.at + self._map.response_time:
            cycles = self._cycles.add(last.number, cast(float, found["cycles"]), latest_pp)
        in_force = {"amplitude": latest_pp, "frequency": 0.0, **last.asked, **found} if state in CYCLING else {}
        return {
            "refusal": 0,
            "heartbeat": 0,
            "sequence": last.number,
            "command": last.code,
            "preset": last.asked.get("preset", 0.0),
            "force_pp": 0.0,
            **found,
            "state": state,
            "amplitude": in_force.get("amplitude", 0.0),
            "frequency": in_force.get("frequency", 0.0),
            "displacement_pp": cycles or (latest_pp,),
        }


OURS = TesterMap(
    name=f"register map {MAP_VERSION}",
    identity=(IDENTITY,),
    detectors=(DETECTORS,),
    status=(STATUS,),
    commands={code: (Write(COMMAND, {"command": code}),) for code in CommandCode if code is not CommandCode.NONE},
    emergency_stop=(Coil(EMERGENCY_STOP_COIL),),
    heartbeat=HEARTBEAT,
    probes=(
        Probe(
            "map_version",
            MAP_VERSION,
            MAP_VERSION,
            f"has register map version {{found}}, this driver knows {MAP_VERSION}; install matching software",
        ),
        Probe("units", Units.SI, Units.SI, "works in units code {found}, not in SI (1); set it"),
    ),
)
"""The map of `rig.registers`, which lacks nothing."""
