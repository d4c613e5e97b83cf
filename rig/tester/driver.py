"""The driver of the elastomer tester: safe commands for its preset and its cycles.

The limits of the rig are checked before anything is sent, and on everything that is measured. A heartbeat keeps the
watchdog of the instrument from acting; when this process dies, the watchdog stops the actuator. Leaving the context
leaves the actuator at rest.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import AbstractContextManager, closing, contextmanager

from daq.errors import afterwards
from rig.errors import RigError, RunStoppedError
from rig.events import ActuatorShutDown, Observer, ignore_event
from rig.registers import Action, CommandCode, Interlock, State
from rig.tester.actuator_stop import COIL_TIME, ActuatorStop
from rig.tester.heartbeat import Heartbeat
from rig.tester.identity import verified_identity
from rig.tester.limits import TesterLimits
from rig.tester.missing_functions import Lack
from rig.tester.modbus import ModbusLink, ModbusProtocolError, ModbusUnreachableError
from rig.tester.register_map import OURS, TesterMap
from rig.tester.reports import TesterReports
from rig.tester.rest_judge import AT_REST, POWERLESS
from rig.tester.status import (
    ActuatorNotAtRestError,
    Detector,
    ImplausibleStatusError,
    LineLostError,
    MotionHaltedError,
    StatusFault,
    TesterStatus,
    TesterTrippedError,
    detectors_from,
    state_text,
)
from rig.tester.status_watch import StatusWatch
from rig.tester.stop_latch import StopLatch
from rig.tester.wire import TesterWire

FIRST_POLL, LONGEST_POLL = 0.0005, 0.05  # s
MOTION_TIMEOUT = 60.0  # s, for a ramp to a preset


@contextmanager
def connect(
    url: str,
    limits: TesterLimits | None = None,
    *,
    timeout: float = 0.25,
    observer: Observer = ignore_event,
    latch: StopLatch | None = None,
    tester_map: TesterMap = OURS,
    without: Collection[Lack] = (),
) -> Iterator[Tester]:
    """Drive the tester at `url` until the context is left, which leaves the actuator at rest whatever happened.

    Args:
        url: ``tcp://host:port``, ``rtu:///dev/ttyS0?baudrate=115200``, or as its codec has it.
        limits: of the rig; None: the default ones.
        timeout: of one reply, s.
        observer: gets events about interlocks, and about the rest of the actuator.
        latch: of the rig; a STOP in force, or any STOP since this call, forbids motion. None: one that nothing sets.
        tester_map: the registers of its controller.
        without: functions of `NEEDS_CONSENT` that the tester may lack.

    Raises:
        TesterMismatchError: another register map, other units, no watchdog or no limits, or a detector that stops
            nothing; nothing was commanded.
        ActuatorNotAtRestError: on leaving, the instrument did not confirm that the actuator is at rest.
        RigError: no tester answers at `url`.
    """
    with closing(ModbusLink(url, timeout, tester_map.codec)) as link:
        tester = Tester(TesterWire(link, tester_map), limits or TesterLimits(), observer, latch, without)
        try:
            with tester.at_rest_afterwards():
                yield tester
        finally:
            tester.close()


class Tester:
    """The driver of one tester, made by `connect`. Any thread may call it.

    Every method that talks to the instrument raises RigError where that does not answer; every one that moves the
    actuator raises RunStoppedError where STOP is in force, or was pressed since the tester was connected.
    """

    def __init__(
        self,
        wire: TesterWire,
        limits: TesterLimits,
        observer: Observer = ignore_event,
        latch: StopLatch | None = None,
        without: Collection[Lack] = (),
    ) -> None:
        self.limits = limits
        self._latch = latch or StopLatch()
        self._epoch = self._latch.epoch
        self._wire = wire
        self._observer = observer
        self._halted = False
        self._undisturbed = True  # no halt since the last command that moves
        self._rested: object | None = None  # of the halt that was seen at rest; None once anything else is commanded
        self._failure: Exception | None = None
        self._watch = StatusWatch()
        self._watching = threading.Lock()
        self.identity = verified_identity(wire, without)
        self._reports = TesterReports(observer, self.identity.serial)
        self._stopping = ActuatorStop(
            wire, self.identity.last_resort, self._reports.seen_at_rest, self._leave_to_watchdog
        )
        wire.join()
        self._beating = threading.Lock()  # of which heartbeat there is
        self._heartbeat = Heartbeat(wire, self.identity.watchdog_time)

    def start(self) -> None:
        """Switch hydraulics on.

        Raises:
            TesterTrippedError: an interlock is set; remove its cause, then `reset`.
            MotionHaltedError: the actuator is halted.
            RigError: the instrument refused.
        """
        self._move(CommandCode.HYDRAULICS_ON)

    def preset(self, position: float) -> None:
        """Ramp to mean `position` m without cycling; returns when it is reached.

        Raises:
            LimitExceededError: beyond the rig's limits; nothing was sent.
            TesterTrippedError: an interlock stopped the actuator.
            MotionHaltedError: the actuator is or was halted.
            RigError: the instrument refused, or did not get there.
        """
        self.limits.check_preset(position)
        self._move(CommandCode.PRESET, preset=position)
        self.wait(lambda status: status.state is State.HELD, f"reach a preset of {1e3 * position:g} mm")

    def cycle(self, amplitude_pp: float, frequency: float) -> None:
        """Begin to cycle about the preset, commanding `amplitude_pp` m peak to peak at `frequency` Hz.

        Raises:
            LimitExceededError: beyond the rig's limits; nothing was sent.
            TesterTrippedError: an interlock stopped the actuator.
            MotionHaltedError: the actuator is halted.
            RigError: the instrument refused.
        """
        self.limits.check_cycle(amplitude_pp, frequency)
        self._move(CommandCode.CYCLE, amplitude=amplitude_pp, frequency=frequency)

    def stop(self) -> None:
        """Stop cycling or ramping and hold the mean position; returns when the actuator is at rest.

        If the measured values show no progress towards rest for `ESCALATE` s, the emergency stop is tripped, whatever
        the instrument acknowledged; a tester without one has its hydraulics switched off. Raises
        ActuatorNotAtRestError where that does not help either.
        """
        self._rested = None
        self._stopping.bring_to_rest()

    def halt(self) -> None:
        """Stop at once, from any thread, and refuse to move until `release`; returns when the actuator is at rest.

        As for `stop`; the preset stays in force and hydraulics stay on, unless only the emergency stop helps. Nothing
        moves it from here until `release`, whatever is raised.
        """
        self._halted = True  # before the command, so that no other thread's slips in after it
        self._rested = None
        self._stopping.bring_to_rest(self._disturbing)
        self._rested = object()

    def release(self) -> None:
        """Allow motion again after a `halt`; nothing moves by this."""
        self._halted = False

    def shut_down(self) -> None:
        """Bring the actuator to rest and switch hydraulics off, by the emergency stop if nothing else helps.

        Raises ActuatorNotAtRestError where the instrument did not confirm it.
        """
        self._rested = None
        self._stopping.shut_down()

    def give_up(self, why: Exception) -> None:
        """Shut down because of `why`, from any thread; every later request for motion or measured values raises `why`.

        This lasts as long as the connection. Raises ActuatorNotAtRestError where the instrument did not confirm that
        the actuator is at rest; the observer was told so.
        """
        self._failure = why  # before the command, so that no other thread's slips in after it
        self.shut_down()
        self._observer(ActuatorShutDown(str(why)))

    @property
    def failure(self) -> Exception | None:
        """Why the tester was given up; None where it was not."""
        return self._failure

    def check_obeys(self) -> None:
        """Check that every stop was obeyed, without the emergency stop.

        Raises:
            ActuatorNotAtRestError: a stop was not obeyed, and the emergency stop did not help either.
            StopDisobeyedError: a stop was not obeyed; the emergency stop brought the actuator to rest.
        """
        self._stopping.check_obeys()

    def check_rest(self) -> None:
        """Check that every stop left the actuator at rest; where that was not confirmed, look whether it rests now.

        Raises ActuatorNotAtRestError where it is not seen at rest now either.
        """
        self._stopping.check_rest()

    @contextmanager
    def obeying_stops(self) -> Iterator[None]:
        """Call `check_obeys` on leaving, also by RunStoppedError or TesterTrippedError; its error has precedence."""
        try:
            yield
        except (RunStoppedError, TesterTrippedError):
            self.check_obeys()
            raise
        self.check_obeys()

    @contextmanager
    def witnessed_by(self, motion_pp: Callable[[], float | None]) -> Iterator[None]:
        """Believe rest only where another instrument agrees, while the context lasts.

        Args:
            motion_pp: oscillation that it measures now, m peak to peak, from any thread; None where there is none
                beyond its noise, or it cannot tell.
        """
        with self._stopping.witnessed_by(motion_pp):
            yield

    def emergency_stop(self) -> None:
        """Trip the emergency stop, whatever the instrument is doing; it has to have one that the network trips."""
        self._wire.emergency_stop(COIL_TIME)

    def withhold_heartbeat(self, patience: float) -> float | None:
        """Send no heartbeat until the watchdog has tripped; it acts only while hydraulics are on.

        Returns the seconds until it tripped; None where it did not within `patience` s. Heartbeats resume afterwards.
        """
        self._heartbeat.join()
        began, waited = time.monotonic(), 0.0
        try:
            while waited < patience:
                waited = time.monotonic() - began
                if self.has_tripped(Interlock.WATCHDOG):
                    return waited
                time.sleep(LONGEST_POLL)
            return None
        finally:
            with self._beating:
                if self._failure is None:  # else the watchdog has to act
                    self._heartbeat = Heartbeat(self._wire, self.identity.watchdog_time)

    def has_tripped(self, interlock: Interlock) -> bool:
        """Whether this interlock has tripped; where the tester does not name it, whether hydraulics are off."""
        status = self.status()
        return interlock in status.interlocks if self._wire.map.shows(interlock) else status.state in POWERLESS

    def reset(self) -> None:
        """Clear the interlocks after their cause is removed; nothing resets by itself. Logged and reported.

        Raises TesterRefusedError where the cause is still there.
        """
        before = self.status().interlocks
        self._wire.command(CommandCode.RESET)
        self._reports.reset(before)

    def detectors(self) -> dict[Interlock, Detector]:
        """The limit detectors as they are in force at the instrument."""
        values = self._wire.detectors()
        return detectors_from(values) if values else {}

    def set_detector(self, interlock: Interlock, limit: float, action: Action) -> None:
        """Set a detector, for example for the range of a test; the instrument accepts none looser than it is set there.

        Args:
            limit: in the unit of the quantity that it watches.
            action: what it does beyond `limit`.

        Raises:
            TesterRefusedError: looser than it is set at the instrument, or no such detector.
        """
        self._wire.command(CommandCode.DETECTOR, detector=int(interlock), action=int(action), limit=float(limit))

    def status(self) -> TesterStatus:
        """Everything that the instrument reports now, tripped or not."""
        return self._wire.status()

    def looked_at(self) -> TesterStatus:
        """The status now, tripped or not; interlocks that fired since the last look are reported to the observer."""
        status = self.status()
        self._reports.seen(status)
        return status

    def measured(self) -> TesterStatus:
        """The status now, where nothing has interfered with the last command.

        Raises:
            TesterTrippedError: an interlock has stopped the actuator.
            MotionHaltedError: the actuator was halted since.
            MeasuredBeyondLimitError: a measured value is beyond a limit of the rig, moving or not.
            ImplausibleStatusError: a sound instrument does not report this.
            LineLostError: the tester does not answer any more; only its watchdog, if it has one, stops it.
            RigError: another client has commanded the tester, also while it is halted.
            Exception: the reason for `give_up`.
        """
        with self._watching:
            if self._failure is not None:
                raise self._failure
            rested = self._rested
            try:
                reading = self._wire.reading()
            except ModbusUnreachableError as error:
                raise self._line_lost(error) from error
            status = reading.status
            self._reports.seen(status)
            self._watch.check(reading, time.monotonic())
        if status.state is State.TRIPPED or status.stopped_by:
            raise self._wire.tripped(status.stopped_by)
        self.limits.check_measured(status)
        is_halted = self._halted or not self._undisturbed
        halted = MotionHaltedError(f"{self._wire.url}: the actuator was halted ({state_text(status.state)})")
        if is_halted and (rested is None or rested is not self._rested):
            raise halted  # our own hold was on its way when the status was read
        if not reading.ours:
            raise ModbusProtocolError(
                f"{self._wire.url}: command {status.sequence} is in force, which this program did not send; end the "
                "other program that controls the tester"
            )
        if is_halted and status.state not in AT_REST:
            raise ImplausibleStatusError(StatusFault.COMMAND, f"it is {state_text(status.state)} after it was halted")
        if is_halted:
            raise halted
        return status

    def wait(self, until: Callable[[TesterStatus], bool], to: str, timeout: float = MOTION_TIMEOUT) -> TesterStatus:
        """Poll the status `until` a condition holds, often at first and then every 50 ms.

        Args:
            to: completes "the tester did not", for the error.
            timeout: s.

        Raises:
            TesterTrippedError: an interlock stopped the actuator.
            MotionHaltedError: the actuator was halted.
            RigError: `timeout` passed, or a measured value is beyond a limit of the rig.
        """
        end, pause = time.monotonic() + timeout, FIRST_POLL
        while not until(status := self.measured()):
            if time.monotonic() > end:
                raise RigError(
                    f"{self._wire.url}: the tester did not {to} within {timeout:g} s, it is {state_text(status.state)}"
                    "; check the specimen, the hydraulic pressure and the display of the tester"
                )
            time.sleep(pause)
            pause = min(1.5 * pause, LONGEST_POLL)
        return status

    def at_rest_afterwards(self) -> AbstractContextManager[None]:
        """Shut the actuator down when the context is left, whatever happens; an error inside has precedence."""
        return afterwards(self.shut_down, RigError)

    def close(self) -> None:
        """Stop the heartbeat; the actuator has to be at rest."""
        self._heartbeat.join()

    def _move(self, code: CommandCode, **values: float) -> None:
        self._wire.command(code, self._moving, **values)

    @contextmanager
    def _moving(self) -> Iterator[None]:
        """The context in which each attempt at a motion command is written: no STOP and no halt came before."""
        with self._latch.moving(epoch=self._epoch):
            if self._failure is not None:
                raise self._failure
            if self._halted:
                raise MotionHaltedError(f"{self._wire.url}: the actuator is halted; release it before it may move")
            self._undisturbed = self._stopping.moved = True
            self._rested = None
            yield

    @contextmanager
    def _disturbing(self) -> Iterator[None]:
        self._undisturbed = False
        yield

    def _leave_to_watchdog(self, error: ActuatorNotAtRestError) -> None:
        before = self._failure
        self._fail(before or error)
        also = "" if before in (None, error) else f". Before that: {before}"
        self._reports.rest_unknown(f"{error}{also}")

    def _line_lost(self, error: ModbusUnreachableError) -> LineLostError:
        lost = LineLostError(f"line lost ({error}); {self.identity.last_resort}")
        self._fail(lost)
        self._reports.line_lost(lost, self.identity.watchdog_time)
        return lost

    def _fail(self, why: Exception) -> None:
        """Refuse to move from now on because of `why`, and let the watchdog act: a heartbeat would keep it from it."""
        self._failure = why  # first, so that no heartbeat begins again meanwhile
        with self._beating:
            self._heartbeat.stop()
