"""Identity and status of the tester, and the errors with which it can refuse."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, cast

from rig.errors import RigError
from rig.registers import DETECTED, STATUS, Action, CommandCode, Interlock, Refusal, State, Value, name_of
from rig.tester.missing_functions import Lack

CYCLING = frozenset({State.CYCLING, State.SETTLED})
"""States in which the actuator cycles."""


class TesterMismatchError(RigError):
    """This driver may not drive the instrument: another register map, other units, no watchdog, no limits."""


class TesterRefusedError(RigError):
    """The instrument refused a command, for the reason `refusal`."""

    def __init__(self, message: str, refusal: Refusal) -> None:
        super().__init__(message)
        self.refusal = refusal


class TesterTrippedError(RigError):
    """The `interlocks` have stopped the actuator, by any action; remove their cause, then reset them."""

    def __init__(self, message: str, interlocks: Interlock) -> None:
        super().__init__(message)
        self.interlocks = interlocks


class MotionHaltedError(RigError):
    """The actuator was halted from outside: it does not move, or not as commanded before the halt."""


class ActuatorNotAtRestError(RigError):
    """The instrument did not confirm that the actuator is at rest; check it before going near."""


class StopDisobeyedError(RigError):
    """A stop was not obeyed, so that the emergency stop was tripped; the actuator is at rest. Repair it, then reset."""


class LineLostError(RigError):
    """The tester does not answer any more: only its watchdog, if it has one, stops the actuator."""


class StatusFault(StrEnum):
    """The kinds of faults in a status of the tester."""

    RANGE = "range"  # a value outside of the register map, or no number
    HEARTBEAT = "heartbeat"  # not the last heartbeat: an old status, or another client beats
    STATE = "state"  # contradicts the amplitude in force, or the measured one
    COMMAND = "command"  # other values in force than were commanded and confirmed
    FROZEN = "frozen"  # it cycles, and counts no cycles


class ImplausibleStatusError(RigError):
    """A status with a right checksum that a sound instrument does not report: it stops the machine like a trip.

    Attributes:
        fault: what is implausible.
    """

    def __init__(self, fault: StatusFault, what: str) -> None:
        super().__init__(
            f"the tester reports an implausible status ({what}); check the tester and its line before the next run"
        )
        self.fault = fault


@dataclass(frozen=True)
class Detector:
    """A limit detector of the instrument: the limit in the unit of its quantity, and the action beyond it."""

    limit: float
    action: Action


@dataclass(frozen=True)
class TesterIdentity:
    """The identity of the instrument, and its limits in SI units as they were in force when it was connected.

    Attributes:
        serial: number of the instrument, or what its map calls it.
        watchdog_time: s; None where it has no watchdog.
        limits: by name, as far as they are known.
        detectors: as far as they are known.
        map_name: of the register map by which it is driven.
        lacks: what it does not have.
    """

    serial: str
    watchdog_time: float | None
    limits: Mapping[str, float]
    detectors: Mapping[Interlock, Detector]
    map_name: str
    lacks: frozenset[Lack] = frozenset()

    @property
    def last_resort(self) -> str:
        """The last means to stop it if this program cannot, as text."""
        return last_resort(self.watchdog_time)


def last_resort(watchdog_time: float | None) -> str:
    """The last means to stop a tester that does not answer, by the time in s of its watchdog; None: it has none."""
    if watchdog_time is None:
        return "press the red button: the tester has no watchdog"
    return f"press the red button; the watchdog of the tester should stop it within {watchdog_time:g} s"


@dataclass(frozen=True)
class TesterStatus:
    """The report of the instrument at one moment; SI units.

    Attributes:
        state: of the actuator.
        interlocks: those that fired since the last reset.
        stopped_by: those of them that stopped the actuator.
        refusal: of the last command, if it was refused.
        heartbeat: the last heartbeat that it received.
        sequence: number of the last command applied.
        command: the last command applied.
        preset: mean position in force.
        amplitude_pp: commanded peak-to-peak amplitude in force; 0 when not cycling.
        frequency: in force; 0 when not cycling.
        cycles: complete ones since the last change.
        displacement_mean: measured.
        force_mean: measured.
        force_pp: measured peak-to-peak force of the last cycle.
        displacement_pp: measured peak-to-peak displacement of the latest complete cycles, latest first.
    """

    state: State
    interlocks: Interlock
    stopped_by: Interlock
    refusal: Refusal
    heartbeat: int
    sequence: int
    command: CommandCode
    preset: float
    amplitude_pp: float
    frequency: float
    cycles: int
    displacement_mean: float
    force_mean: float
    force_pp: float
    displacement_pp: tuple[float, ...]

    @property
    def is_stopped(self) -> bool:
        """Whether an interlock has stopped the actuator, also where the tester does not name it."""
        return self.state is State.TRIPPED or bool(self.stopped_by)


_CODES: Mapping[str, Callable[[int], Any]] = {
    "state": State,
    "interlocks": Interlock,
    "stopped_by": Interlock,
    "refusal": Refusal,
    "command": CommandCode,
}
_NUMBERS = ("heartbeat", "sequence", "cycles", "preset", "frequency", "displacement_mean", "force_mean", "force_pp")


def status_from(values: Mapping[str, Value]) -> TesterStatus:
    """The status from the values of the STATUS block.

    Raises ImplausibleStatusError where a value is outside of the range that the map gives it.
    """
    if strange := STATUS.out_of_range(values):
        raise ImplausibleStatusError(StatusFault.RANGE, "; ".join(strange))
    codes = {name: kind(cast(int, values[name])) for name, kind in _CODES.items()}
    cycles = (cycle for cycle in cast(tuple[float, ...], values["displacement_pp"]) if cycle > 0)
    numbers: dict[str, Any] = {name: values[name] for name in _NUMBERS}
    return TesterStatus(
        **numbers, **codes, amplitude_pp=cast(float, values["amplitude"]), displacement_pp=tuple(cycles)
    )


def detectors_from(values: Mapping[str, Value]) -> dict[Interlock, Detector]:
    """The detectors from the values of the DETECTORS block. Raises RigError where the map does not have a code."""
    with _known_codes():
        return {
            interlock: Detector(
                cast(float, values[f"{name_of(interlock)}_limit"]),
                Action(cast(int, values[f"{name_of(interlock)}_action"])),
            )
            for interlock in DETECTED
        }


@contextmanager
def _known_codes() -> Iterator[None]:
    try:
        yield
    except ValueError as error:
        raise RigError(f"the tester reports a code that its map does not have: {error}") from error


def stopping_text(interlocks: Interlock) -> str:
    """What has stopped the actuator, for a message: the interlocks, or a trip whose cause the tester does not name."""
    return interlock_text(interlocks) if interlocks else "something that it does not name"


INTERLOCK_TEXTS = {
    Interlock.UPPER_DISPLACEMENT: "upper displacement limit",
    Interlock.LOWER_DISPLACEMENT: "lower displacement limit",
    Interlock.FORCE: "force limit",
    Interlock.ERROR: "error limit (overshoot)",
    Interlock.UNDERPEAK: "underpeak limit",
    Interlock.WATCHDOG: "watchdog",
    Interlock.EMERGENCY_STOP: "emergency stop",
}


def interlock_text(interlocks: Interlock) -> str:
    """Names of the interlocks, for a message."""
    return ", ".join(INTERLOCK_TEXTS[one] for one in interlocks) or "nothing"


def state_text(state: State) -> str:
    """The state of the actuator as the tester reports it, for a message."""
    return state.name.lower().replace("_", " ")
