"""Whole blocks and numbered commands on the Modbus line of the tester: each arrives once, or raises an error.

A request is repeated when there was no answer or a garbled one, within one allowance of attempts and of time for the
whole call. A command keeps its sequence number over all attempts, so that the instrument applies it once, and the
values in force are read back afterwards.
"""

import logging
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from typing import TypeVar, cast

from rig.errors import RigError
from rig.fair_lock import FairLock
from rig.modbus import HURRY, Around, ModbusLink, ModbusProtocolError, ModbusRefusedError, ModbusUnreachableError
from rig.registers import (
    COMMAND,
    DETECTORS,
    EMERGENCY_STOP_COIL,
    HEARTBEAT,
    STATUS,
    Block,
    ChecksumError,
    CommandCode,
    Interlock,
    Refusal,
    State,
    Value,
    float32,
    name_of,
)
from rig.status_watch import Reading
from rig.tester_status import (
    MotionHaltedError,
    TesterRefusedError,
    TesterStatus,
    TesterTrippedError,
    interlock_text,
    status_from,
)

ATTEMPTS = 3  # at the transactions of one call
URGENT_TIMEOUT = 0.15  # s for the reply to one request of a stop; a status takes 0.07 s at 19,200 baud
SLACK = 0.2  # s that a call may take beyond the timeouts of its attempts
BUSY_PAUSE = 0.05  # s
BEATS = 10  # in one watchdog time; with each of them an old status shows its age

log = logging.getLogger(__name__)

# busy, or not what was sent: the instrument judged nothing, or a block with a changed bit
WORTH_REPEATING = frozenset({Refusal.BUSY, Refusal.CHECKSUM, Refusal.NONE})

_ECHOES: Mapping[CommandCode, tuple[str, ...]] = {
    CommandCode.PRESET: ("preset",),
    CommandCode.CYCLE: ("amplitude", "frequency"),
}

_Result = TypeVar("_Result")


class _Allowance:
    """The attempts and the time of one call: ATTEMPTS of them, and as many timeouts.

    An urgent call has one short attempt, and others `within` so many s.
    """

    def __init__(self, timeout: float, within: float | None = None) -> None:
        self.urgent = within is not None
        self._timeout = URGENT_TIMEOUT if self.urgent else timeout
        self._end = time.monotonic() + (ATTEMPTS * timeout + SLACK if within is None else within)
        self._left = ATTEMPTS

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

    def __init__(self, link: ModbusLink) -> None:
        self.url = link.url
        self._link = link
        self._lock = FairLock()
        self._numbering = threading.Lock()
        self._sequence = 0
        self._in_force = frozenset({0})  # more than one after a command that failed: it may have been applied
        self._asked: Mapping[str, float] = {}  # of the last command that was confirmed
        self._beats: frozenset[int] | None = None  # one of them is the last that arrived; None before the first one

    def join(self) -> None:
        """Go on from the sequence number that the instrument has. Raises RigError where it does not answer."""
        self._sequence = self.status().sequence
        self._in_force = frozenset({self._sequence})

    def read(self, block: Block) -> dict[str, Value]:
        """The values of a block, as they were sent.

        Raises:
            ModbusUnreachableError: no answer.
            ModbusProtocolError: garbled answers only, or no such block.
        """
        return self._read(block, _Allowance(self._link.timeout))

    def status(self) -> TesterStatus:
        """What the instrument reports now. Raises RigError where it does not answer."""
        return status_from(self.read(STATUS))

    def reading(self) -> Reading:
        """What the instrument reports now, when no command is on its way. Raises RigError where it does not answer."""
        with self._lock:
            return self._reading(_Allowance(self._link.timeout))

    def urgent_reading(self, within: float) -> Reading:
        """What the instrument reports now, before all other requests.

        Raises RigError where it does not answer within so many s.
        """
        return self._reading(_Allowance(self._link.timeout, within))

    def _reading(self, allowance: _Allowance) -> Reading:
        commands, beats, asked = self._in_force, self._beats, self._asked
        status = status_from(self._read(STATUS, allowance))
        # what another thread sent in the meantime may be in force, or not yet
        ours = status.sequence in commands | self._in_force
        fresh = beats is None or self._beats is None or status.heartbeat in beats | self._beats
        return Reading(status, ours, fresh, asked if commands == self._in_force else {})

    def beat(self, count: int) -> None:
        """Send one heartbeat, once. Raises RigError where it did not arrive, or its reply did not."""
        if self._beats is not None:
            self._beats |= {count}
        self._link.write_holding(HEARTBEAT.address, HEARTBEAT.pack({"heartbeat": count}))
        self._beats = frozenset({count})

    def emergency_stop(self, within: float) -> None:
        """Trip the emergency stop, before all other requests.

        Raises RigError where the instrument does not answer within so many s.
        """
        allowance = _Allowance(self._link.timeout, within)
        self._try(lambda: self._link.write_coil(EMERGENCY_STOP_COIL, True, allowance.by, urgent=True), allowance)

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
        """The same within so many s, before all other requests: a command that waits for its reply is overtaken."""
        self._apply(code, sending, {}, _Allowance(self._link.timeout, within))

    def _apply(self, code: CommandCode, sending: Around, values: Mapping[str, float], allowance: _Allowance) -> None:
        with self._numbering:
            number = self._sequence = self._sequence % 0xFFFF + 1
            self._in_force |= {number}
        asked: dict[str, Value] = {
            "preset": 0.0,
            "amplitude": 0.0,
            "frequency": 0.0,
            "detector": 0,
            "action": 0,
            "limit": 0.0,
            **values,
            "command": code,
            "sequence": number,
        }
        words = COMMAND.pack(asked)
        try:
            self._try(lambda: self._send(code, words, allowance, sending), allowance)
            self._verify(code, asked, allowance)
        except (ModbusUnreachableError, ModbusProtocolError, TesterRefusedError) as error:
            if self._sequence != number:
                raise MotionHaltedError(f"{self.url}: a stop overtook {code.name}") from error
            raise
        with self._numbering:
            if self._sequence == number:
                self._in_force, self._asked = frozenset({number}), values

    def tripped(self, interlocks: Interlock) -> TesterTrippedError:
        """The error for an actuator that `interlocks` stopped."""
        return TesterTrippedError(
            f"the tester was stopped by {interlock_text(interlocks)}; remove the cause, then reset", interlocks
        )

    def _send(self, code: CommandCode, words: list[int], allowance: _Allowance, sending: Around) -> None:
        try:
            self._link.write_holding(COMMAND.address, words, allowance.by, sending, urgent=allowance.urgent)
        except ModbusRefusedError as error:
            status = status_from(self._read(STATUS, allowance))
            if status.refusal is Refusal.TRIPPED:
                raise self.tripped(status.stopped_by) from error
            refusal = Refusal.BUSY if error.busy else status.refusal
            reason = refusal.name.lower().replace("_", " ") if refusal else str(error)
            raise TesterRefusedError(f"the tester refused {code.name.lower()}: {reason}", refusal) from error

    def _verify(self, code: CommandCode, asked: Mapping[str, Value], allowance: _Allowance) -> None:
        """Compare the values in force with those sent, unless an interlock has stopped the actuator since."""
        status = self._read(STATUS, allowance)
        names: tuple[str, ...] = ("sequence", "command")
        if status["state"] != State.TRIPPED and not status["stopped_by"]:
            names += _ECHOES.get(code, ())
        self._compare({name: asked[name] for name in names}, status)
        if code is CommandCode.DETECTOR:
            name = name_of(Interlock(cast(int, asked["detector"])))
            wanted = {f"{name}_limit": asked["limit"], f"{name}_action": asked["action"]}
            self._compare(wanted, self._read(DETECTORS, allowance))

    def _compare(self, wanted: Mapping[str, Value], found: Mapping[str, Value]) -> None:
        for name, sent in wanted.items():
            expected = float32(sent) if isinstance(sent, float) else sent
            if found[name] != expected:
                raise ModbusProtocolError(
                    f"{self.url}: {name} {sent} was sent, {found[name]} is in force; is there another client?"
                )

    def _read(self, block: Block, allowance: _Allowance) -> dict[str, Value]:
        def read() -> dict[str, Value]:
            try:
                words = self._link.read_input(block.address, block.count, allowance.by, urgent=allowance.urgent)
                return block.unpack(words)
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


class Heartbeat:
    """Keeps the watchdog from acting until it is stopped, or the thread that made it has ended and drives no more."""

    def __init__(self, wire: TesterWire, watchdog_time: float) -> None:
        self._wire = wire
        self._pause = watchdog_time / BEATS
        self._stopped = threading.Event()
        self._owner = threading.current_thread()
        self._thread = threading.Thread(target=self._beat, name="tester heartbeat", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop beating; from now on the watchdog acts."""
        self._stopped.set()

    def join(self) -> None:
        """Stop, and return when the last beat is over."""
        self.stop()
        self._thread.join()

    def _beat(self) -> None:
        count = 0
        while self._owner.is_alive() and not self._stopped.is_set():
            count = count % 0xFFFF + 1
            try:
                self._wire.beat(count)
            except RigError as error:
                # nothing else to do here: the watchdog acts when beats stay away, and every command shows the error
                log.info("a heartbeat did not arrive: %s", error)
            self._stopped.wait(self._pause)
