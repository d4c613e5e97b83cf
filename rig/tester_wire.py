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
from rig.modbus import Around, ModbusLink, ModbusProtocolError, ModbusRefusedError, ModbusUnreachableError
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
from rig.tester_status import TesterRefusedError, TesterStatus, TesterTrippedError, interlock_text, status_from

ATTEMPTS = 3  # at the transactions of one call
SLACK = 0.2  # s that a call may take beyond the timeouts of its attempts
BUSY_PAUSE = 0.05  # s
BEATS = 5  # in one watchdog time

log = logging.getLogger(__name__)

# busy, or not what was sent: the instrument judged nothing, or a block with a changed bit
WORTH_REPEATING = frozenset({Refusal.BUSY, Refusal.CHECKSUM, Refusal.NONE})

_ECHOES: Mapping[CommandCode, tuple[str, ...]] = {
    CommandCode.PRESET: ("preset",),
    CommandCode.CYCLE: ("amplitude", "frequency"),
}

_Result = TypeVar("_Result")


class _Allowance:
    """The attempts and the time of one call: ATTEMPTS of them, and as many timeouts."""

    def __init__(self, timeout: float) -> None:
        self.by = time.monotonic() + ATTEMPTS * timeout + SLACK
        self._timeout = timeout
        self._left = ATTEMPTS

    def is_over(self) -> bool:
        """Count a failed attempt; whether it was the last."""
        self._left -= 1
        return self._left <= 0 or time.monotonic() + self._timeout > self.by


class TesterWire:
    """The line to one tester. Any thread may use it; commands go out one at a time."""

    def __init__(self, link: ModbusLink) -> None:
        self.url = link.url
        self._link = link
        self._lock = FairLock()
        self._sequence = 0
        self._in_force = {0}  # more than one after a command that failed: it may have been applied

    def join(self) -> None:
        """Go on from the sequence number that the instrument has. Raises RigError where it does not answer."""
        self._sequence = self.status().sequence
        self._in_force = {self._sequence}

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

    def status_and_command(self) -> tuple[TesterStatus, bool]:
        """What the instrument reports now, and whether the command in force is one of ours.

        Raises RigError where it does not answer.
        """
        with self._lock:
            status = self.status()
            return status, status.sequence in self._in_force

    def beat(self, count: int) -> None:
        """Send one heartbeat, once. Raises RigError where it did not arrive, or its reply did not."""
        self._link.write_holding(HEARTBEAT.address, HEARTBEAT.pack({"heartbeat": count}))

    def emergency_stop(self) -> None:
        """Trip the emergency stop. Raises RigError where the instrument does not answer."""
        allowance = _Allowance(self._link.timeout)
        self._try(lambda: self._link.write_coil(EMERGENCY_STOP_COIL, True, allowance.by), allowance)

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
        """
        allowance = _Allowance(self._link.timeout)
        if not self._lock.acquire(allowance.by - time.monotonic()):
            raise ModbusUnreachableError(f"{self.url}: {code.name} was not sent, another command still waits")
        try:
            self._sequence = self._sequence % 0xFFFF + 1
            self._in_force.add(self._sequence)
            asked: dict[str, Value] = {
                "preset": 0.0,
                "amplitude": 0.0,
                "frequency": 0.0,
                "detector": 0,
                "action": 0,
                "limit": 0.0,
                **values,
                "command": code,
                "sequence": self._sequence,
            }
            words = COMMAND.pack(asked)
            self._try(lambda: self._send(code, words, allowance, sending), allowance)
            self._verify(code, asked, allowance)
            self._in_force = {self._sequence}
        finally:
            self._lock.release()

    def tripped(self, interlocks: Interlock) -> TesterTrippedError:
        """The error for an actuator that `interlocks` stopped."""
        return TesterTrippedError(
            f"{self.url} was stopped by {interlock_text(interlocks)}; remove the cause, then reset", interlocks
        )

    def _send(self, code: CommandCode, words: list[int], allowance: _Allowance, sending: Around) -> None:
        try:
            self._link.write_holding(COMMAND.address, words, allowance.by, sending)
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
                return block.unpack(self._link.read_input(block.address, block.count, allowance.by))
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
                if error.refusal not in WORTH_REPEATING or allowance.is_over():
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
