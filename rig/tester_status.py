"""What the tester says of itself and of its state, and the ways in which it can say no."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import cast

from rig.errors import RigError
from rig.registers import DETECTED, Action, CommandCode, Interlock, Refusal, State, Value, name_of


class TesterMismatchError(RigError):
    """The instrument is not what this driver may drive: another register map, other units, no watchdog, no limits."""


class TesterRefusedError(RigError):
    """The instrument refused a command.

    Attributes:
        refusal: its own reason.
    """

    def __init__(self, message: str, refusal: Refusal) -> None:
        super().__init__(message)
        self.refusal = refusal


class TesterTrippedError(RigError):
    """An interlock has stopped the actuator, by whatever action; see to its cause, then reset it.

    Attributes:
        interlocks: which.
    """

    def __init__(self, message: str, interlocks: Interlock) -> None:
        super().__init__(message)
        self.interlocks = interlocks


class MotionHaltedError(RigError):
    """The actuator was halted from outside: it does not move, or not as it was told before the halt."""


class ActuatorNotAtRestError(RigError):
    """The instrument did not confirm that the actuator is at rest; look at it before going near."""


@dataclass(frozen=True)
class Detector:
    """A limit detector of the instrument: its limit in the unit of what it watches, and what it does beyond it."""

    limit: float
    action: Action


@dataclass(frozen=True)
class TesterIdentity:
    """What the instrument says it is; limits in SI units, as they were in force when it was connected."""

    serial: str
    watchdog_time: float
    limits: Mapping[str, float]
    detectors: Mapping[Interlock, Detector]


@dataclass(frozen=True)
class TesterStatus:
    """What the instrument reports at one moment; SI units.

    Attributes:
        state: what the actuator is doing.
        interlocks: what has fired since the last reset.
        stopped_by: those of them that stopped the actuator.
        refusal: why the last command was refused, if it was.
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


def status_from(values: Mapping[str, Value]) -> TesterStatus:
    """Make a status of the values of the STATUS block.

    Raises:
        RigError: a code that the map does not have.
    """
    codes = {name: cast(int, values[name]) for name in ("sequence", "cycles")}
    quantities = {
        name: cast(float, values[name])
        for name in ("preset", "frequency", "displacement_mean", "force_mean", "force_pp")
    }
    try:
        return TesterStatus(
            state=State(cast(int, values["state"])),
            interlocks=Interlock(cast(int, values["interlocks"])),
            stopped_by=Interlock(cast(int, values["stopped_by"])),
            refusal=Refusal(cast(int, values["refusal"])),
            command=CommandCode(cast(int, values["command"])),
            amplitude_pp=cast(float, values["amplitude"]),
            displacement_pp=tuple(cycle for cycle in cast(tuple[float, ...], values["displacement_pp"]) if cycle > 0),
            sequence=codes["sequence"],
            cycles=codes["cycles"],
            **quantities,
        )
    except ValueError as error:
        raise RigError(f"the tester reports a code that its map does not have: {error}") from error


def detectors_from(values: Mapping[str, Value]) -> dict[Interlock, Detector]:
    """Make detectors of the values of the DETECTORS block.

    Raises:
        RigError: a code that the map does not have.
    """
    try:
        return {
            interlock: Detector(
                cast(float, values[f"{name_of(interlock)}_limit"]),
                Action(cast(int, values[f"{name_of(interlock)}_action"])),
            )
            for interlock in DETECTED
        }
    except ValueError as error:
        raise RigError(f"the tester reports a code that its map does not have: {error}") from error


def interlock_text(interlocks: Interlock) -> str:
    """The interlocks in words, for a message."""
    return ", ".join(name_of(one).replace("_", " ") for one in interlocks) or "nothing"
