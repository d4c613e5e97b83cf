"""The elastomer tester: a safe way to ask its actuator for a preset and for cycles.

Every command carries a sequence number and is read back, so that a lost reply does not apply it twice and a flipped bit
does not pass. The rig's limits are checked before anything is sent. A thread beats the heart that the instrument's
watchdog listens for; when this process dies, the watchdog stops the actuator. Leaving the context leaves it at rest.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from typing import TypeVar, cast

from rig.errors import RigError
from rig.modbus import ModbusLink, ModbusProtocolError, ModbusRefusedError, ModbusUnreachableError
from rig.registers import (
    COMMAND,
    EMERGENCY_STOP_COIL,
    HEARTBEAT,
    IDENTITY,
    MAP_VERSION,
    STATUS,
    Block,
    ChecksumError,
    CommandCode,
    Refusal,
    State,
    Units,
    Value,
    float32,
)
from rig.tester_limits import TesterLimits
from rig.tester_status import (
    ActuatorNotAtRestError,
    TesterIdentity,
    TesterMismatchError,
    TesterRefusedError,
    TesterStatus,
    TesterTrippedError,
    names_of,
    status_from,
)

ATTEMPTS = 3  # at one transaction
BEATS = 5  # in one watchdog time
BUSY_PAUSE = 0.05  # s
FIRST_POLL, LONGEST_POLL = 0.0005, 0.05  # s
MOTION_TIMEOUT = 60.0  # s, for a ramp to a preset
AT_REST = frozenset({State.HYDRAULICS_OFF, State.IDLE, State.HELD, State.TRIPPED})

# busy, or not what was sent: the instrument judged nothing, or a block with a changed bit
WORTH_ANOTHER_TRY = frozenset({Refusal.BUSY, Refusal.CHECKSUM, Refusal.NONE})

log = logging.getLogger(__name__)
_Result = TypeVar("_Result")


@contextmanager
def connect(
    url: str, limits: TesterLimits | None = None, *, timeout: float = 0.5, device_id: int = 1
) -> Iterator[Tester]:
    """Drive the tester at `url` until the context is left, which leaves the actuator at rest whatever happened.

    Args:
        url: ``tcp://host:port`` or ``rtu:///dev/ttyS0?baudrate=115200``.
        limits: of the rig; None is the ordinary ones.
        timeout: of one reply, s.
        device_id: Modbus unit number.

    Raises:
        TesterMismatchError: another register map, other units, no watchdog or no limits; nothing was commanded.
        ActuatorNotAtRestError: on leaving, the instrument did not confirm that the actuator is at rest.
        RigError: no tester answers at `url`.
    """
    with closing(ModbusLink(url, device_id, timeout)) as link:
        tester = Tester(link, limits or TesterLimits())
        try:
            with tester.at_rest_afterwards():
                yield tester
        finally:
            tester.close()


class Tester:
    """The driver of one tester, made by `connect`. Any thread may call it."""

    def __init__(self, link: ModbusLink, limits: TesterLimits) -> None:
        self.limits = limits
        self._link = link
        self._lock = threading.RLock()
        self.identity = self._verify()
        self._sequence = self.status().sequence
        self._in_force = {self._sequence}  # more than one after a command that failed: it may have been applied
        self._closed = threading.Event()
        # the heart stops with the thread that opened the tester: a beat without an owner guards nothing
        self._owner = threading.current_thread()
        self._heart = threading.Thread(target=self._beat, name="tester heartbeat", daemon=True)
        self._heart.start()

    def start(self) -> None:
        """Switch hydraulics on.

        Raises:
            TesterTrippedError: an interlock is set; see to its cause, then `reset`.
            RigError: the instrument refused or does not answer.
        """
        self._command(CommandCode.HYDRAULICS_ON)

    def preset(self, position: float) -> None:
        """Ramp to mean `position` m without cycling; returns when it is reached.

        Raises:
            LimitExceededError: beyond the rig's limits; nothing was sent.
            TesterTrippedError: an interlock stopped the actuator.
            RigError: the instrument refused, does not answer, or did not get there.
        """
        self.limits.check_preset(position)
        self._command(CommandCode.PRESET, preset=position)
        self.wait(lambda status: status.state is State.HELD, f"reach a preset of {position:g} m")

    def cycle(self, amplitude_pp: float, frequency: float) -> None:
        """Begin to cycle about the preset, commanding `amplitude_pp` m peak to peak at `frequency` Hz.

        Raises:
            LimitExceededError: beyond the rig's limits; nothing was sent.
            TesterTrippedError: an interlock stopped the actuator.
            RigError: the instrument refused or does not answer.
        """
        self.limits.check_cycle(amplitude_pp, frequency)
        self._command(CommandCode.CYCLE, amplitude=amplitude_pp, frequency=frequency)

    def stop(self) -> None:
        """Stop cycling or ramping and hold the mean position; returns when the actuator is at rest.

        Raises:
            RigError: the instrument refused, does not answer, or did not come to rest.
        """
        self._command(CommandCode.HOLD)
        self._wait_for_rest()

    def shut_down(self) -> None:
        """Bring the actuator to rest and switch hydraulics off, by the emergency stop if nothing else helps.

        Raises:
            ActuatorNotAtRestError: the instrument did not confirm it.
        """
        try:
            self.stop()
            self._command(CommandCode.HYDRAULICS_OFF)
        except RigError as error:
            log.warning("the tester did not stop as asked (%s); pulling the emergency stop", error)
            try:
                self.emergency_stop()
                self._wait_for_rest()
            except RigError as worse:
                self._closed.set()  # no more beats, so that the watchdog acts
                raise ActuatorNotAtRestError(
                    f"{self._link.url}: the actuator was not confirmed at rest ({worse}); its watchdog stops it within "
                    f"{self.identity.watchdog_time:g} s, look at it before going near"
                ) from error

    def emergency_stop(self) -> None:
        """Trip the emergency stop, whatever the instrument is doing.

        Raises:
            RigError: the instrument does not answer.
        """
        self._try(lambda: self._link.write_coil(EMERGENCY_STOP_COIL, True))

    def reset(self) -> None:
        """Clear the interlocks after their cause has been seen to; nothing resets by itself.

        Raises:
            TesterRefusedError: the cause is still there.
            RigError: the instrument does not answer.
        """
        before = self.status().interlocks
        self._command(CommandCode.RESET)
        log.warning("interlocks of %s reset: %s", self.identity.serial, names_of(before))

    def status(self) -> TesterStatus:
        """Everything that the instrument reports now, tripped or not.

        Raises:
            RigError: the instrument does not answer.
        """
        return status_from(self._read(STATUS))

    def state(self) -> State:
        """What the actuator is doing now.

        Raises:
            RigError: the instrument does not answer.
        """
        return self.status().state

    def measured(self) -> TesterStatus:
        """What is measured now, while nothing is wrong.

        Raises:
            TesterTrippedError: an interlock has stopped the actuator.
            RigError: the instrument does not answer, or another client has commanded it.
        """
        with self._lock:
            status, expected = self.status(), self._in_force
        if status.state is State.TRIPPED:
            raise self._tripped(status)
        if status.sequence not in expected:
            raise ModbusProtocolError(
                f"{self._link.url}: command {status.sequence} is in force, which is not ours; is there another client?"
            )
        return status

    def wait(self, until: Callable[[TesterStatus], bool], to: str, timeout: float = MOTION_TIMEOUT) -> TesterStatus:
        """Poll what is measured `until` it is as wanted, often at first and then every 50 ms.

        Args:
            until: whether to return.
            to: what is waited for, for the error.
            timeout: s.

        Raises:
            TesterTrippedError: an interlock stopped the actuator.
            RigError: `timeout` passed, or the instrument does not answer.
        """
        end, pause = time.monotonic() + timeout, FIRST_POLL
        while not until(status := self.measured()):
            if time.monotonic() > end:
                raise RigError(f"{self._link.url}: waited {timeout:g} s to {to}, it is {status.state.name} still")
            time.sleep(pause)
            pause = min(1.5 * pause, LONGEST_POLL)
        return status

    @contextmanager
    def at_rest_afterwards(self) -> Iterator[None]:
        """Whatever happens inside, shut the actuator down at the end; an error inside is what comes out."""
        try:
            yield
        except BaseException as error:
            try:
                self.shut_down()
            except RigError as failure:
                error.add_note(str(failure))
            raise
        self.shut_down()

    def close(self) -> None:
        """Stop the heartbeat; the actuator has to be at rest."""
        self._closed.set()
        self._heart.join()

    def _verify(self) -> TesterIdentity:
        try:
            found = self._read(IDENTITY)
        except ModbusProtocolError as error:
            raise TesterMismatchError(f"{self._link.url} is no tester with this register map: {error}") from error
        if found["map_version"] != MAP_VERSION:
            raise TesterMismatchError(
                f"{self._link.url} has register map version {found['map_version']}, this driver knows {MAP_VERSION}; "
                "install matching software"
            )
        if found["units"] != Units.SI:
            raise TesterMismatchError(f"{self._link.url} works in units code {found['units']}, not in SI (1); set it")
        limits = {name: value for name, value in found.items() if isinstance(value, float)}
        watchdog_time = limits.pop("watchdog_time")
        if not watchdog_time > 0:
            raise TesterMismatchError(f"{self._link.url} has its watchdog off; set its time before driving it")
        missing = [name for name, value in limits.items() if name != "lower_displacement_limit" and not value > 0]
        if missing:
            raise TesterMismatchError(f"{self._link.url} has no {', '.join(missing)}; set it at the instrument")
        return TesterIdentity(str(found["serial"]), watchdog_time, limits)

    def _command(self, code: CommandCode, preset: float = 0.0, amplitude: float = 0.0, frequency: float = 0.0) -> None:
        with self._lock:
            self._sequence = self._sequence % 0xFFFF + 1
            self._in_force.add(self._sequence)
            asked: dict[str, Value] = {
                "command": code,
                "sequence": self._sequence,
                "preset": preset,
                "amplitude": amplitude,
                "frequency": frequency,
            }
            words = COMMAND.pack(asked)
            # the same sequence number each time: the instrument applies it once
            self._try(lambda: self._send(code, words))
            self._verify_echo(asked, self._read(STATUS))
            self._in_force = {self._sequence}

    def _send(self, code: CommandCode, words: list[int]) -> None:
        try:
            self._link.write_holding(COMMAND.address, words)
        except ModbusRefusedError as error:
            status = self.status()
            if status.refusal is Refusal.TRIPPED:
                raise self._tripped(status) from error
            refusal = Refusal.BUSY if error.busy else status.refusal
            reason = refusal.name.lower().replace("_", " ") if refusal else str(error)
            raise TesterRefusedError(f"the tester refused {code.name.lower()}: {reason}", refusal) from error

    def _verify_echo(self, asked: Mapping[str, Value], status: Mapping[str, Value]) -> None:
        """Compare what the instrument has applied with what was asked; a trip in between is another matter."""
        checked = ["sequence", "command"]
        if status["state"] != State.TRIPPED:
            checked += {CommandCode.PRESET: ["preset"], CommandCode.CYCLE: ["amplitude", "frequency"]}.get(
                CommandCode(cast(int, asked["command"])), []
            )
        for name in checked:
            sent = asked[name]
            expected = float32(sent) if isinstance(sent, float) else sent
            if status[name] != expected:
                raise ModbusProtocolError(
                    f"{self._link.url}: {name} {sent} was sent, {status[name]} is in force; is there another client?"
                )

    def _read(self, block: Block) -> dict[str, Value]:
        def read() -> dict[str, Value]:
            try:
                return block.unpack(self._link.read_input(block.address, block.count))
            except ChecksumError as error:
                raise ModbusProtocolError(f"{self._link.url}: {error}") from error
            except ModbusRefusedError as error:
                # these blocks can always be read, so the request was changed on the way, or this is another instrument
                raise ModbusProtocolError(str(error)) from error

        return self._try(read)

    def _try(self, attempt: Callable[[], _Result]) -> _Result:
        """Make one transaction that may be repeated, up to ATTEMPTS times."""
        for left in reversed(range(ATTEMPTS)):
            try:
                return attempt()
            except (ModbusUnreachableError, ModbusProtocolError):
                if not left:
                    raise
            except TesterRefusedError as error:
                if not left or error.refusal not in WORTH_ANOTHER_TRY:
                    raise
                time.sleep(BUSY_PAUSE)
        raise AssertionError("not reached")

    def _wait_for_rest(self) -> None:
        end = time.monotonic() + MOTION_TIMEOUT
        while (status := self.status()).state not in AT_REST:
            if time.monotonic() > end:
                raise RigError(f"{self._link.url}: the actuator is {status.state.name} after a stop")
            time.sleep(FIRST_POLL)

    def _beat(self) -> None:
        count, pause = 0, self.identity.watchdog_time / BEATS
        while self._owner.is_alive() and not self._closed.is_set():
            count = count % 0xFFFF + 1
            try:
                self._link.write_holding(HEARTBEAT.address, HEARTBEAT.pack({"heartbeat": count}))
            except RigError as error:
                # nothing else to do here: the watchdog acts when beats stay away, and every command shows the error
                log.info("a heartbeat did not arrive: %s", error)
            self._closed.wait(pause)

    def _tripped(self, status: TesterStatus) -> TesterTrippedError:
        return TesterTrippedError(
            f"{self._link.url} was stopped by {names_of(status.interlocks)}; see to the cause, then reset",
            status.interlocks,
        )
