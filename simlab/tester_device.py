"""The tester's controller: the state machine, limits and interlocks behind its registers, without any wire.

Motion runs on bench time. The watchdog runs on wall-clock time, because it guards communication with a client that
lives on wall-clock time, however fast the bench runs.
"""

import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import cast

from rig.registers import (
    CYCLES_REPORTED,
    DETECTED,
    DETECTORS,
    HEARTBEAT,
    IDENTITY,
    MAP_VERSION,
    STATUS,
    Action,
    ChecksumError,
    CommandCode,
    Interlock,
    Refusal,
    RegisterBlock,
    State,
    Units,
    Value,
    is_newer,
    name_of,
)
from simlab.actuator import Actuator
from simlab.detectors import Detectors, Motion, SimulatedDetector

SETTLED_WITHIN = 0.005  # of the steady amplitude
PRESET_WITHIN = 1e-9  # m
REST_WITHIN = 1e-7  # m peak to peak


@dataclass(frozen=True)
class DeviceLimits:
    """The settings at the instrument, in SI units.

    Meanings are those of the IDENTITY and DETECTORS blocks; the network can only tighten the detectors.
    """

    watchdog_time: float = 2.0
    upper_displacement_limit: float = 1.5e-3
    lower_displacement_limit: float = -0.5e-3
    force_limit: float = 5e3
    amplitude_limit: float = 5e-4
    frequency_limit: float = 250.0
    velocity_limit: float = 0.2
    acceleration_limit: float = 200.0
    error_limit: float = 5e-5
    underpeak_limit: float = 0.5
    upper_displacement_action: Action = Action.PROGRAM_INTERLOCK
    lower_displacement_action: Action = Action.PROGRAM_INTERLOCK
    force_action: Action = Action.PROGRAM_INTERLOCK
    error_action: Action = Action.PROGRAM_INTERLOCK
    underpeak_action: Action = Action.INDICATE

    def detector(self, interlock: Interlock) -> SimulatedDetector:
        """The detector of `interlock` as it is set."""
        name = name_of(interlock)
        return SimulatedDetector(getattr(self, f"{name}_limit"), getattr(self, f"{name}_action"))


SERIAL = "SIM-ET-0001"


class TesterDevice:
    """The controller of one tester; any thread may call it.

    Attributes:
        applied: every command applied so far, for tests that count.
        watchdog_works: whether it trips where heartbeats stay away.
        longest_unheard: longest time since the last heartbeat at which the actuator was still moving, s (wall clock).
    """

    def __init__(self, actuator: Actuator, now: Callable[[], float], limits: DeviceLimits | None = None) -> None:
        self.applied: list[CommandCode] = []
        self.watchdog_works = True
        self.longest_unheard = 0.0
        self._actuator = actuator
        self._now = now
        self._limits = limits or DeviceLimits()
        self._detectors = Detectors({interlock: self._limits.detector(interlock) for interlock in DETECTED})
        self._lock = threading.RLock()
        self._hydraulics = False
        self._preset: float | None = None
        self._amplitude = 0.0
        self._frequency = 0.0
        self._came_from_pp = 0.0
        self._interlocks = Interlock(0)
        self._firing = Interlock(0)  # detectors that are beyond their limits now, and have acted
        self._stopped_by = Interlock(0)
        self._locked = False  # until a reset
        self._refusal = Refusal.NONE
        self._sequence = 0
        self._last: Mapping[str, Value] = {"command": CommandCode.NONE}
        self._heartbeat = 0
        self._heard = time.monotonic()
        self._button = False

    def identity(self) -> dict[str, Value]:
        """Values of the IDENTITY block."""
        limits = self._limits
        return {
            "map_version": MAP_VERSION,
            "units": Units.SI,
            "serial": SERIAL,
            "watchdog_time": limits.watchdog_time,
            "amplitude_limit": limits.amplitude_limit,
            "frequency_limit": limits.frequency_limit,
            "velocity_limit": limits.velocity_limit,
            "acceleration_limit": limits.acceleration_limit,
        }

    def detectors(self) -> dict[str, Value]:
        """Values of the DETECTORS block."""
        return self._detectors.values()

    def status(self) -> dict[str, Value]:
        """Values of the STATUS block, as of now."""
        with self._lock:
            self.tick()
            now = self._now()
            force_mean, force_pp = self._actuator.force(now)
            cycles = [float(cycle) for cycle in self._actuator.latest_cycles_pp(now, CYCLES_REPORTED)]
            return {
                "state": self._state(now),
                "interlocks": self._interlocks,
                "stopped_by": self._stopped_by,
                "refusal": self._refusal,
                "heartbeat": self._heartbeat,
                "sequence": self._sequence,
                "command": self._last["command"],
                "preset": self._preset or 0.0,
                "amplitude": self._amplitude,
                "frequency": self._frequency,
                "cycles": min(self._actuator.cycles_since_command(now), 2**32 - 1),
                "displacement_mean": self._actuator.mean(now),
                "force_mean": force_mean,
                "force_pp": force_pp,
                "displacement_pp": tuple(cycles + [0.0] * (CYCLES_REPORTED - len(cycles))),
            }

    def read(self, block: RegisterBlock) -> list[int]:
        """The words of a readable block."""
        return block.pack({IDENTITY: self.identity, DETECTORS: self.detectors, STATUS: self.status}[block]())

    def write(self, block: RegisterBlock, words: Sequence[int]) -> Refusal:
        """Take the words of a writable block: a heartbeat, or a command, which is applied or refused."""
        with self._lock:
            try:
                values = block.unpack(words)
            except ChecksumError:
                self._refusal = Refusal.CHECKSUM
                return self._refusal
            if block is not HEARTBEAT:
                return self._take_command(values)
            if (count := int(cast(int, values["heartbeat"]))) != self._heartbeat:
                self._heartbeat, self._heard = count, time.monotonic()
            return Refusal.NONE

    def refuse(self, refusal: Refusal) -> None:
        """Say that the last command was refused for `refusal`, whatever it was."""
        with self._lock:
            self._refusal = refusal

    def emergency_stop(self, *, latched: bool = True) -> None:
        """Stop now. `latched` is the mushroom button, which has to be released before a reset; the coil is not."""
        with self._lock:
            self._button = self._button or latched
            self._trip(Interlock.EMERGENCY_STOP)

    def release_emergency_stop(self) -> None:
        """Turn the mushroom button back; the interlock stays until it is reset."""
        self._button = False

    def is_moving(self) -> bool:
        """Whether the actuator cycles or ramps, by its physics."""
        rest = self._actuator.rests_since(REST_WITHIN)
        return rest is None or rest > self._now()

    def tick(self) -> None:
        """Look at the detectors and the watchdog; the controller does this all the time."""
        with self._lock:
            unheard = time.monotonic() - self._heard
            if self.is_moving():
                self.longest_unheard = max(self.longest_unheard, unheard)
            if self.watchdog_works and self._hydraulics and unheard > self._limits.watchdog_time:
                self._trip(Interlock.WATCHDOG)
            firing = self._detected(self._now())
            began, self._firing = firing & ~self._firing, firing
            for interlock in began:
                self._trip(interlock)

    def _take_command(self, values: Mapping[str, Value]) -> Refusal:
        self.tick()
        if values == self._last:
            return Refusal.NONE  # the same again: its reply was lost
        self._refusal = self._reason_to_refuse(values)
        if self._refusal is Refusal.NONE:
            sequence = int(cast(int, values["sequence"]))
            self._last, self._sequence = values, sequence if is_newer(sequence, self._sequence) else self._sequence
            self._apply(CommandCode(cast(int, values["command"])), values)
        return self._refusal

    def _reason_to_refuse(self, values: Mapping[str, Value]) -> Refusal:
        if values["command"] not in set(CommandCode) - {CommandCode.NONE}:
            return Refusal.UNKNOWN_COMMAND
        command = CommandCode(cast(int, values["command"]))
        if command in (CommandCode.HOLD, CommandCode.HYDRAULICS_OFF):
            return Refusal.NONE  # a stop is never refused
        if not is_newer(cast(int, values["sequence"]), self._sequence):
            return Refusal.STALE_SEQUENCE
        if command is CommandCode.DETECTOR:
            interlock, action = cast(int, values["detector"]), cast(int, values["action"])
            allowed = self._detectors.may_be(interlock, cast(float, values["limit"]), action)
            return Refusal.NONE if allowed else Refusal.DETECTOR_LIMIT
        cause_present = self._button or any(self._stops(interlock) for interlock in self._firing)
        if command is CommandCode.RESET:
            return Refusal.CAUSE_STILL_PRESENT if cause_present else Refusal.NONE
        if self._locked:
            return Refusal.TRIPPED
        if command is CommandCode.HYDRAULICS_ON:
            return Refusal.NONE
        if not self._hydraulics:
            return Refusal.HYDRAULICS_ARE_OFF
        if cause_present:
            return Refusal.CAUSE_STILL_PRESENT
        if command is CommandCode.PRESET:
            lowest, highest = self._range
            # written so that a value that is not a number is refused
            return Refusal.NONE if lowest <= cast(float, values["preset"]) <= highest else Refusal.PRESET_LIMIT
        return self._reason_to_refuse_cycle(cast(float, values["amplitude"]), cast(float, values["frequency"]))

    def _reason_to_refuse_cycle(self, amplitude_pp: float, frequency: float) -> Refusal:
        limits, omega = self._limits, 2 * math.pi * frequency
        if self._preset is None or abs(self._actuator.mean(self._now()) - self._preset) > PRESET_WITHIN:
            return Refusal.NOT_AT_PRESET
        if not 0 < amplitude_pp <= limits.amplitude_limit:
            return Refusal.AMPLITUDE_LIMIT
        if not 0 < frequency <= limits.frequency_limit:
            return Refusal.FREQUENCY_LIMIT
        if omega * amplitude_pp / 2 > limits.velocity_limit:
            return Refusal.VELOCITY_LIMIT
        if omega**2 * amplitude_pp / 2 > limits.acceleration_limit:
            return Refusal.ACCELERATION_LIMIT
        lowest, highest = self._range
        if self._preset + amplitude_pp / 2 > highest or self._preset - amplitude_pp / 2 < lowest:
            return Refusal.DISPLACEMENT_LIMIT
        return Refusal.NONE

    def _apply(self, command: CommandCode, values: Mapping[str, Value]) -> None:
        self.applied.append(command)
        match command:
            case CommandCode.HYDRAULICS_ON:
                if not self._hydraulics:
                    self._hydraulics, self._heard = True, time.monotonic()
            case CommandCode.HYDRAULICS_OFF:
                self._switch_off()
            case CommandCode.PRESET:
                self._preset = cast(float, values["preset"])
                self._rest()
                self._actuator.move(self._preset)
            case CommandCode.CYCLE:
                self._amplitude, self._frequency = cast(float, values["amplitude"]), cast(float, values["frequency"])
                self._came_from_pp = self._actuator.amplitude_pp(self._now())
                self._actuator.cycle(self._amplitude, self._frequency)
            case CommandCode.HOLD:
                self._hold()
            case CommandCode.RESET:
                self._interlocks = self._firing = self._stopped_by = Interlock(0)
                self._locked = False
            case CommandCode.DETECTOR:
                interlock = Interlock(cast(int, values["detector"]))
                detector = SimulatedDetector(cast(float, values["limit"]), Action(cast(int, values["action"])))
                self._detectors.tighten(interlock, detector)
                self._firing &= ~interlock  # beyond a limit that has moved, it acts again

    def _detected(self, now: float) -> Interlock:
        """Detectors that fire now; the largest excursion is that of the mean plus half the peak-to-peak value."""
        if not self._hydraulics:
            return Interlock(0)
        mean, amplitude_pp = self._actuator.mean(now), self._actuator.amplitude_pp(now)
        force_mean, force_pp = self._actuator.force(now)
        return self._detectors.firing(
            Motion(
                highest=mean + amplitude_pp / 2,
                lowest=mean - amplitude_pp / 2,
                force=abs(force_mean) + force_pp / 2,
                amplitude_pp=amplitude_pp,
                commanded_pp=self._amplitude,
                previous_pp=self._came_from_pp,
                steady=self._is_steady(amplitude_pp),
            )
        )

    def _trip(self, interlock: Interlock) -> None:
        if interlock in self._interlocks and not self._stops(interlock):
            return
        self._interlocks |= interlock
        action = self._detectors.action_of(interlock)
        if action >= Action.HOLD:
            self._stopped_by |= interlock
            self._hold()
        if action >= Action.STOP:
            self._preset = None
        if action >= Action.PROGRAM_INTERLOCK:
            self._locked = True
        if action >= Action.HYDRAULIC_INTERLOCK:
            self._switch_off()

    def _stops(self, interlock: Interlock) -> bool:
        return self._detectors.action_of(interlock) >= Action.HOLD

    def _switch_off(self) -> None:
        """Without hydraulics the actuator comes to rest and the specimen pushes it back to zero."""
        if self._hydraulics:
            self._actuator.move(0.0)
        self._hydraulics, self._preset = False, None
        self._rest()

    def _rest(self) -> None:
        self._amplitude = self._frequency = 0.0

    def _hold(self) -> None:
        self._rest()
        if self._hydraulics:  # without them, nothing holds the mean
            self._actuator.hold()

    @property
    def _range(self) -> tuple[float, float]:
        """Lowest and highest position that the detectors allow, m."""
        return self._detectors[Interlock.LOWER_DISPLACEMENT].limit, self._detectors[Interlock.UPPER_DISPLACEMENT].limit

    def _is_steady(self, amplitude_pp: float) -> bool:
        steady = self._actuator.steady_pp()
        return abs(amplitude_pp - steady) <= SETTLED_WITHIN * steady

    def _state(self, now: float) -> State:
        if self._locked:
            return State.TRIPPED
        if not self._hydraulics:
            return State.HYDRAULICS_OFF
        if self._amplitude > 0.0:
            return State.SETTLED if self._is_steady(self._actuator.amplitude_pp(now)) else State.CYCLING
        if self._actuator.is_ramping(now) or self._actuator.amplitude_pp(now) > REST_WITHIN:
            return State.RAMPING
        return State.IDLE if self._preset is None else State.HELD
