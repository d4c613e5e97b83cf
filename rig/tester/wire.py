"""Whole blocks and numbered commands on the Modbus line of the tester: each arrives once, or raises an error.

A request is repeated when there was no answer or a garbled one, within one allowance of attempts and of time for the
whole call. A command keeps its sequence number over all attempts, so that the instrument applies it once, and the
values in force are read back afterwards. A controller that has no numbers is watched until it shows what was commanded.
"""

import struct
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from typing import TypeVar, cast

from rig.errors import RigError
from rig.fair_lock import FairLock
from rig.registers import (
    ChecksumError,
    CommandCode,
    Interlock,
    Kind,
    Refusal,
    RegisterBlock,
    State,
    Value,
    float32,
    name_of,
)
from rig.tester.modbus import (
    HURRY,
    Around,
    ModbusLink,
    ModbusProtocolError,
    ModbusRefusedError,
    ModbusUnreachableError,
)
from rig.tester.register_map import OURS, Coil, Confirmed, MapStep, StatusMemory, TesterMap
from rig.tester.status import (
    CYCLING,
    MotionHaltedError,
    TesterRefusedError,
    TesterStatus,
    TesterTrippedError,
    state_text,
    status_from,
    stopping_text,
)
from rig.tester.status_watch import StatusReading

ATTEMPTS = 3  # at the transactions of one call
URGENT_TIMEOUT = 0.15  # s for the reply to one request of a stop; a status takes 0.07 s at 19,200 baud
SLACK = 0.2  # s that a call may take beyond the timeouts of its attempts
BUSY_PAUSE = 0.05  # s
REFUSED_PAUSE = 0.01  # s before an emergency stop that was refused is sent again
EFFECT_POLL = 0.01  # s between two looks at whether a command has had its effect

# refusals that are not about the command: the instrument was busy, or the request was changed on the way
WORTH_REPEATING = frozenset({Refusal.BUSY, Refusal.CHECKSUM, Refusal.NONE})

_SET_VALUES: Mapping[CommandCode, tuple[str, ...]] = {
    CommandCode.PRESET: ("preset",),
    CommandCode.CYCLE: ("amplitude", "frequency"),
}
"""Values that a command sets, and that a status shows when they are in force."""

_MOTION = frozenset({CommandCode.HYDRAULICS_ON, CommandCode.PRESET, CommandCode.CYCLE})
_NOTHING_ASKED: Mapping[str, Value] = {
    "preset": 0.0,
    "amplitude": 0.0,
    "frequency": 0.0,
    "detector": 0,
    "action": 0,
    "limit": 0.0,
}

_Result = TypeVar("_Result")


class _Allowance:
    """The attempts and the time of one call: ATTEMPTS attempts, and a timeout for each.

    An urgent call makes short attempts, as many as fit into `within` s.
    """

    def __init__(self, timeout: float, within: float | None = None, attempts: int = ATTEMPTS) -> None:
        self.urgent = within is not None
        self._timeout = URGENT_TIMEOUT if self.urgent else timeout
        self._end = time.monotonic() + (attempts * timeout + SLACK if within is None else within)
        self._left = attempts

    @property
    def by(self) -> float:
        """When the next attempt has to be over, s of `time.monotonic`."""
        return min(self._end, time.monotonic() + self._timeout) if self.urgent else self._end

    def is_over(self, pause: float = 0.0) -> bool:
        """Count a failed attempt; whether it was the last: another one, after `pause` s, would have too little time."""
        self._left -= 1
        needed = pause + (HURRY if self.urgent else self._timeout)
        return (self._left <= 0 and not self.urgent) or time.monotonic() + needed > self._end


class TesterWire:
    """The line to one tester. Any thread may use it; commands go out one at a time, but an urgent one overtakes."""

    def __init__(self, link: ModbusLink, tester_map: TesterMap = OURS) -> None:
        self.url = link.url
        self.map = tester_map
        self._link = link
        self._memory = StatusMemory(tester_map)
        self._lock = FairLock()
        self._numbering = threading.Lock()
        self._is_joined = False
        self._sequence = 0
        self._in_force = frozenset({0})  # more than one after a command that failed: it may have been applied
        self._last = Confirmed()
        self._beats: frozenset[int] | None = None  # one of them is the last that arrived; None before the first one

    def join(self) -> None:
        """Go on from the sequence number that the instrument has. Raises RigError where it does not answer."""
        self._join(self.status())

    def _join(self, status: TesterStatus) -> None:
        self._sequence = status.sequence
        self._in_force = frozenset({self._sequence})
        self._is_joined = True

    def identity(self) -> dict[str, Value]:
        """The identity that the instrument reports, with the values that its map states. Raises as `detectors`."""
        return {**self.map.stated, **self._values(self.map.identity, _Allowance(self._link.timeout))}

    def detectors(self) -> dict[str, Value]:
        """The values of its detectors; empty where they cannot be read.

        Raises:
            ModbusUnreachableError: no answer.
            ModbusProtocolError: garbled answers only, or no such block.
        """
        return self._values(self.map.detectors, _Allowance(self._link.timeout))

    def status(self) -> TesterStatus:
        """The present status. Raises RigError where the instrument does not answer."""
        return self._status(_Allowance(self._link.timeout))

    def poll(self) -> TesterStatus:
        """As `status`, with one attempt. Raises RigError where it does not answer."""
        return self._status(_Allowance(self._link.timeout, attempts=1))

    def reading(self) -> StatusReading:
        """The present status, when no command is on its way. Raises RigError where the instrument does not answer."""
        with self._lock:
            return self._reading(_Allowance(self._link.timeout))

    def urgent_reading(self, within: float) -> StatusReading:
        """The present status, before all other requests.

        Raises RigError where it does not answer within `within` s.
        """
        return self._reading(_Allowance(self._link.timeout, within))

    def _reading(self, allowance: _Allowance) -> StatusReading:
        commands, beats, last = self._in_force, self._beats, self._last
        status = self._status(allowance)
        # what another thread sent in the meantime may be in force, or not yet
        ours = not self.map.numbers_commands or status.sequence in commands | self._in_force
        shown = self.map.shows_heartbeat and beats is not None and self._beats is not None
        fresh = not shown or status.heartbeat in (beats or frozenset()) | (self._beats or frozenset())
        return StatusReading(status, ours, fresh, last.in_force if commands == self._in_force else {})

    def _status(self, allowance: _Allowance) -> TesterStatus:
        last, now = self._last, time.monotonic()
        return status_from(self._memory.completed(self._values(self.map.status, allowance), last, now))

    def beat(self, count: int) -> None:
        """Send one heartbeat, once. Raises RigError where it did not arrive, or its reply did not."""
        block = self.map.heartbeat
        assert block is not None, "it has a watchdog"
        if self._beats is not None:
            self._beats |= {count}
        self._link.write_holding(block.address, block.pack({"heartbeat": count}))
        self._beats = frozenset({count})

    def emergency_stop(self, within: float) -> None:
        """Trip the emergency stop, before all other requests.

        Raises RigError where the instrument does not answer within `within` s, or refuses until then.
        """
        allowance = _Allowance(self._link.timeout, within)
        frames = self._frames(self.map.emergency_stop, {})

        def attempt() -> None:
            try:
                self._write(frames, allowance, nullcontext)
            except ModbusRefusedError as error:
                # no state forbids it, so that the instrument was busy, or the request was changed on the way
                time.sleep(REFUSED_PAUSE)
                raise ModbusProtocolError(str(error)) from error

        self._try(attempt, allowance)

    def command(self, code: CommandCode, sending: Around = nullcontext, **values: float) -> None:
        """Have one command applied, once, and read it back.

        Args:
            code: what to ask for.
            sending: a context for each attempt to send it, which raises where it must not be sent any more.
            values: registers of the COMMAND block that this command uses.

        Raises:
            TesterTrippedError: an interlock that has to be reset first.
            TesterRefusedError: the instrument refused it.
            ModbusUnreachableError: no answer; whether it was applied is unknown.
            ModbusProtocolError: something else is in force afterwards.
            MotionHaltedError: an urgent command overtook it.
        """
        allowance = _Allowance(self._link.timeout)
        if not self._lock.acquire(allowance.by - time.monotonic()):
            raise ModbusUnreachableError(f"{self.url}: {code.name} was not sent, another command still waits")
        try:
            self._apply(code, sending, values, allowance)
        finally:
            self._lock.release()

    def urgent_command(self, code: CommandCode, within: float, sending: Around = nullcontext) -> None:
        """As `command`, in `within` s and before all other requests; overtakes a command that waits for its reply.

        Before `join` it stops under any number first, which no instrument refuses, and joins then: reading the number
        of the instrument before would delay the stop.
        """
        if self.map.numbers_commands and not self._is_joined:
            allowance = _Allowance(self._link.timeout, within)
            frames = self._frames(self._steps(code), {**_NOTHING_ASKED, "sequence": 0})
            self._try(lambda: self._send(code, frames, allowance, sending), allowance)
            self._join(self._status(allowance))
        self._apply(code, sending, {}, _Allowance(self._link.timeout, within))

    def _apply(self, code: CommandCode, sending: Around, values: Mapping[str, float], allowance: _Allowance) -> None:
        with self._numbering:
            number = self._sequence = self._sequence % 0xFFFF + 1
            self._in_force |= {number}
        asked = {**_NOTHING_ASKED, **values, "sequence": number}
        frames = self._frames(self._steps(code), asked)
        numbered = self.map.numbers_commands

        def attempt() -> dict[str, float]:
            self._send(code, frames, allowance, sending)
            # without a number, a late write of an earlier command may overtake it, so that it has to be sent again; a
            # stop is judged by what the actuator does, and need not wait here for what the controller says
            return {} if numbered or allowance.urgent else self._see_effect(code, asked)

        try:
            in_force = self._try(attempt, allowance)
            if numbered:
                in_force = self._verify(code, asked, allowance)
        except (ModbusUnreachableError, ModbusProtocolError, TesterRefusedError) as error:
            if self._sequence != number:
                raise MotionHaltedError(f"{self.url}: a stop overtook {code.name}") from error
            raise
        with self._numbering:
            if self._sequence == number:
                self._in_force = frozenset({number})
                self._last = Confirmed(number, code, values, in_force, time.monotonic())

    def tripped(self, interlocks: Interlock) -> TesterTrippedError:
        """The error for an actuator that `interlocks` stopped."""
        what = stopping_text(interlocks)
        return TesterTrippedError(f"the tester was stopped by {what}; remove the cause, then reset", interlocks)

    def _steps(self, code: CommandCode) -> tuple[MapStep, ...]:
        steps = self.map.commands.get(code)
        if steps is None:
            raise TesterRefusedError(
                f"{self.map.name} has no {code.name.lower()}; set it at the instrument", Refusal.UNKNOWN_COMMAND
            )
        return steps

    def _frames(self, steps: tuple[MapStep, ...], asked: Mapping[str, Value]) -> list[tuple[MapStep, list[int]]]:
        """The words of each step. Raises RigError where a value does not fit its register; nothing was sent."""
        try:
            return [
                (step, [] if isinstance(step, Coil) else step.block.pack({**asked, **step.constants})) for step in steps
            ]
        except (struct.error, OverflowError, ValueError) as error:
            raise RigError(f"{self.map.name}: a value does not fit its register ({error}); nothing was sent") from error

    def _write(self, frames: list[tuple[MapStep, list[int]]], allowance: _Allowance, sending: Around) -> None:
        for step, words in frames:
            if isinstance(step, Coil):
                self._link.write_coil(step.address, step.value, allowance.by, sending, urgent=allowance.urgent)
                continue
            address = step.block.address
            self._link.write_holding(address, words, allowance.by, sending, urgent=allowance.urgent)
            if step.read_back and (found := self._words(step.block, allowance)) != words:
                raise ModbusProtocolError(
                    f"{self.url}: {words} was written to holding registers from {address}, they have {found}; is "
                    "there another program that controls the tester?"
                )

    def _send(
        self, code: CommandCode, frames: list[tuple[MapStep, list[int]]], allowance: _Allowance, sending: Around
    ) -> None:
        try:
            self._write(frames, allowance, sending)
        except ModbusRefusedError as error:
            status = self._status(allowance)
            unnamed = code in _MOTION and status.state is State.TRIPPED and not self.map.numbers_commands
            if status.refusal is Refusal.TRIPPED or unnamed:
                raise self.tripped(status.stopped_by) from error
            refusal = Refusal.BUSY if error.busy else status.refusal
            reason = refusal.name.lower().replace("_", " ") if refusal else str(error)
            raise TesterRefusedError(f"the tester refused {code.name.lower()}: {reason}", refusal) from error

    def _verify(self, code: CommandCode, asked: Mapping[str, Value], allowance: _Allowance) -> dict[str, float]:
        """Compare the values in force with those sent, unless an interlock has stopped the actuator since.

        Returns those that belong to `code`, as they are in force.
        """
        status = self._values(self.map.status, allowance)
        self._compare({"sequence": asked["sequence"], "command": code}, status)
        if code is CommandCode.DETECTOR:
            name = name_of(Interlock(cast(int, asked["detector"])))
            wanted = {f"{name}_limit": asked["limit"], f"{name}_action": asked["action"]}
            self._compare(wanted, self._values(self.map.detectors, allowance))
        if status["state"] == State.TRIPPED or status["stopped_by"]:
            if code is CommandCode.RESET:
                raise TesterRefusedError(
                    "the tester acknowledged reset and is still stopped; remove the cause, then reset",
                    Refusal.CAUSE_STILL_PRESENT,
                )
            return {}
        names = _SET_VALUES.get(code, ())
        self._compare({name: asked[name] for name in names}, status)
        return {name: cast(float, status[name]) for name in names}

    def _see_effect(self, code: CommandCode, asked: Mapping[str, Value]) -> dict[str, float]:
        """Wait until the status shows what `code` does; returns the values in force that the controller reports.

        Raises:
            TesterTrippedError: an interlock stopped it instead.
            TesterRefusedError: it does not show within the response time of the map.
        """
        end = time.monotonic() + self.map.response_time
        while True:
            began = time.monotonic()
            status = self.map.translated(self._values(self.map.status, _Allowance(self._link.timeout)))
            state, stopped_by = State(cast(int, status["state"])), Interlock(cast(int, status["stopped_by"]))
            if code in _MOTION and (state is State.TRIPPED or stopped_by):
                raise self.tripped(stopped_by)
            in_force = {name: cast(float, status[name]) for name in _SET_VALUES.get(code, ()) if name in status}
            wrong = [
                name for name, found in in_force.items() if not self.map.agrees(name, cast(float, asked[name]), found)
            ]
            shows = _shows(code, state, stopped_by)
            if shows and not wrong:
                return in_force
            if began > end:
                cause = Refusal.CAUSE_STILL_PRESENT if code is CommandCode.RESET else Refusal.FAULT
                seen = ", ".join(
                    [f"it is {state_text(state)}", *(f"{name} {in_force[name]:g} is in force" for name in wrong)]
                )
                raise TesterRefusedError(
                    f"the tester acknowledged {code.name.lower()} and does not show it after "
                    f"{self.map.response_time:g} s: {seen}",
                    Refusal.NONE if shows else cause,  # other values than were sent are worth another attempt
                )
            time.sleep(EFFECT_POLL)

    def _compare(self, wanted: Mapping[str, Value], found: Mapping[str, Value]) -> None:
        for name, sent in wanted.items():
            expected = float32(sent) if isinstance(sent, float) else sent
            if found[name] != expected:
                raise ModbusProtocolError(
                    f"{self.url}: {name} {sent} was sent, {found[name]} is in force; is there another "
                    "program that controls the tester?"
                )

    def _values(self, blocks: tuple[RegisterBlock, ...], allowance: _Allowance) -> dict[str, Value]:
        return {name: value for block in blocks for name, value in self._read(block, allowance).items()}

    def _words(self, block: RegisterBlock, allowance: _Allowance) -> list[int]:
        read = self._link.read_input if block.kind is Kind.INPUT else self._link.read_holding
        return read(block.address, block.count, allowance.by, urgent=allowance.urgent)

    def _read(self, block: RegisterBlock, allowance: _Allowance) -> dict[str, Value]:
        def read() -> dict[str, Value]:
            try:
                return block.unpack(self._words(block, allowance))
            except ChecksumError as error:
                raise ModbusProtocolError(f"{self.url}: {error}") from error
            except ModbusRefusedError as error:
                # these blocks can always be read, so the request was changed on the way, or this is another instrument
                raise ModbusProtocolError(str(error)) from error

        return self._try(read, allowance)

    def _try(self, attempt: Callable[[], _Result], allowance: _Allowance) -> _Result:
        """Make one transaction that may be repeated, until it succeeds or `allowance` is over."""
        while True:
            try:
                return attempt()
            except (ModbusUnreachableError, ModbusProtocolError):
                if allowance.is_over():
                    raise
            except TesterRefusedError as error:
                if error.refusal not in WORTH_REPEATING or allowance.is_over(BUSY_PAUSE):
                    raise
                time.sleep(BUSY_PAUSE)


def _shows(code: CommandCode, state: State, stopped_by: Interlock) -> bool:
    """Whether the actuator is in a state that `code` leads to."""
    match code:
        case CommandCode.HYDRAULICS_ON:
            return state is not State.HYDRAULICS_OFF
        case CommandCode.HYDRAULICS_OFF:
            return state in (State.HYDRAULICS_OFF, State.TRIPPED)
        case CommandCode.PRESET:
            return state in (State.RAMPING, State.HELD)
        case CommandCode.CYCLE:
            return state in CYCLING
        case CommandCode.RESET:
            return state is not State.TRIPPED and not stopped_by
        case _:
            return state not in CYCLING
