"""Stopping the actuator of a tester: by a hold, and by the emergency stop where the hold is not visibly obeyed.

A stop is over when the measured values show rest (`rig.tester.rest_judge`), not when the instrument acknowledges it.
"""

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, nullcontext, suppress

from daq.errors import afterwards
from rig.errors import RigError
from rig.events import Observer
from rig.registers import CommandCode, Interlock, State
from rig.tester.missing_functions import Lack
from rig.tester.modbus import Around, ModbusLink
from rig.tester.register_map import TesterMap
from rig.tester.reports import TesterReports
from rig.tester.rest_judge import AT_REST, ESCALATE, POWERLESS, RestJudge, StopProgress
from rig.tester.status import (
    ActuatorNotAtRestError,
    StopDisobeyedError,
    TesterStatus,
    last_resort,
    state_text,
)
from rig.tester.status_watch import StatusReading
from rig.tester.wire import URGENT_TIMEOUT, TesterWire

POLL = 0.0005  # s between two statuses of a stop
COIL_TIME = 0.2  # s for writing the coil of the emergency stop
REST_UNKNOWN = "the actuator was not confirmed at rest"

log = logging.getLogger(__name__)


def stop_tester(url: str, tester_map: TesterMap, observer: Observer, timeout: float = 0.25) -> None:
    """Bring the actuator of the tester at `url` to rest and switch hydraulics off, also if another client drives it.

    Identity, detectors and watchdog are not looked at: they matter for motion only. No heartbeat is sent.

    Args:
        url: as for `rig.tester.driver.connect`.
        tester_map: the registers of its controller.
        observer: gets events about interlocks, and about the rest of the actuator.
        timeout: of connecting and of one reply, s.

    Raises:
        ActuatorNotAtRestError: the instrument did not confirm that the actuator is at rest.
        RigError: `url` is no address of a tester.
    """
    with closing(ModbusLink(url, timeout, tester_map.codec)) as link:
        reports = TesterReports(observer, url)
        # heartbeats of another client may keep its watchdog from acting
        resort = last_resort(None) if tester_map.heartbeat is None else "press the red button"
        stop = ActuatorStop(
            TesterWire(link, tester_map), resort, reports.seen_at_rest, lambda error: reports.rest_unknown(str(error))
        )
        link.connect()
        with afterwards(stop.shut_down, RigError):
            stop.bring_to_rest()


class ActuatorStop:
    """Stops the actuator of one tester. Any thread may call it.

    Args:
        wire: the line to the tester.
        last_resort: what a person has to do where rest is not confirmed, as text.
        report: gets the status that shows the actuator at rest.
        leave_to_watchdog: called with the error where rest is not confirmed; has to end the heartbeats.

    Attributes:
        moved: whether a motion command was written since the last `shut_down`; the actuator may still move then.
    """

    def __init__(
        self,
        wire: TesterWire,
        last_resort: str,
        report: Callable[[TesterStatus], None],
        leave_to_watchdog: Callable[[ActuatorNotAtRestError], None],
    ) -> None:
        self.moved = False
        self._wire = wire
        self._last_resort = last_resort
        self._report = report
        self._leave_to_watchdog = leave_to_watchdog
        self._witness: Callable[[], float | None] = lambda: None
        self._disobeyed: RigError | None = None
        self._unknown: ActuatorNotAtRestError | None = None  # raised before: the watchdog has to act

    def bring_to_rest(self, sending: Around = nullcontext) -> None:
        """See `Tester.stop`; `sending` is a context for each attempt to send the hold."""
        began = time.monotonic()
        try:
            self._wire.urgent_command(CommandCode.HOLD, ESCALATE, sending)
            self._wait_for_rest(began, lambda reading: reading.ours and reading.fresh)
        except RigError as error:
            self._pull_emergency_stop(error)

    def shut_down(self) -> None:
        """See `Tester.shut_down`."""
        if self._unknown is not None:
            with suppress(RigError):  # where the line is back: what has no watchdog moves on, or somebody switched on
                self._switch_off()
            self._see_that_it_stopped(self._unknown)
            return
        self.bring_to_rest()
        self.moved = False
        try:
            self._switch_off()
        except RigError as error:
            self._pull_emergency_stop(error)

    def check_obeys(self) -> None:
        """See `Tester.check_obeys`."""
        if self._unknown is not None:
            raise self._unknown
        if self._disobeyed is not None:
            done = "tripped its emergency stop" if self._has_emergency_stop else "switched its hydraulics off"
            raise StopDisobeyedError(
                f"the tester did not obey a stop ({self._disobeyed}), so the program {done}. Have the tester repaired, "
                "then reset it"
            ) from self._disobeyed

    def check_rest(self) -> None:
        """See `Tester.check_rest`."""
        if self._unknown is not None:
            self._see_that_it_stopped(self._unknown)

    @contextmanager
    def witnessed_by(self, motion_pp: Callable[[], float | None]) -> Iterator[None]:
        """See `Tester.witnessed_by`."""
        before, self._witness = self._witness, motion_pp
        try:
            yield
        finally:
            self._witness = before

    def _switch_off(self) -> None:
        """Switch hydraulics off. Raises RigError where they are not off within `ESCALATE` s of the reply."""
        self._wire.urgent_command(CommandCode.HYDRAULICS_OFF, ESCALATE)
        by = time.monotonic() + ESCALATE
        while (state := self._wire.urgent_reading(ESCALATE).status.state) not in POWERLESS:
            if time.monotonic() > by:
                raise RigError(f"{self._wire.url}: hydraulics were switched off, and it is still {state_text(state)}")
            time.sleep(POLL)

    @property
    def _has_emergency_stop(self) -> bool:
        return Lack.EMERGENCY_STOP not in self._wire.map.lacks

    def _pull_emergency_stop(self, why: RigError) -> None:
        what = (
            "tripping the emergency stop"
            if self._has_emergency_stop
            else "switching hydraulics off, it has no other stop"
        )
        log.warning("the tester did not stop as asked (%s); %s", why, what)
        self._disobeyed = why
        try:
            if self._has_emergency_stop:
                self._wire.emergency_stop(COIL_TIME)
            else:
                self._wire.urgent_command(CommandCode.HYDRAULICS_OFF, ESCALATE)
            self._wait_for_rest(time.monotonic(), self._shows_power_is_off)
        except RigError as worse:
            self._unknown = ActuatorNotAtRestError(f"{self._wire.url}: {REST_UNKNOWN} ({worse}); {self._last_resort}")
            self._leave_to_watchdog(self._unknown)
            raise self._unknown from why

    def _shows_power_is_off(self, reading: StatusReading) -> bool:
        if self._wire.map.emergency_stop and self._wire.map.shows(Interlock.EMERGENCY_STOP):
            return Interlock.EMERGENCY_STOP in reading.status.interlocks
        return reading.status.state in POWERLESS

    def _wait_for_rest(self, began: float, shows_it: Callable[[StatusReading], bool]) -> None:
        """Return when the actuator is at rest. Raises RigError where it goes on moving, or shows nothing.

        Args:
            began: when the stop was asked for, s of `time.monotonic`.
            shows_it: whether a status was made after that.
        """
        judge = RestJudge(began)
        while True:
            try:
                reading = self._wire.urgent_reading(max(began + ESCALATE - time.monotonic(), URGENT_TIMEOUT))
            except RigError:
                if time.monotonic() > began + ESCALATE:
                    raise
                continue
            progress = judge.judge(reading.status, time.monotonic())
            if not shows_it(reading) and time.monotonic() - began >= self._wire.map.response_time:
                raise RigError(f"{self._wire.url}: an old status, or another client commands the tester")
            if progress is StopProgress.RESTS and shows_it(reading):
                self._check_with_witness(reading.status.state)
                self._report(reading.status)
                return
            if progress is StopProgress.MOVES:
                state = state_text(reading.status.state)
                raise RigError(f"{self._wire.url}: the actuator still moves after a stop ({state})")
            time.sleep(POLL)

    def _check_with_witness(self, state: State) -> None:
        """Check that an actuator reported at rest does rest. Raises RigError where another instrument sees it move."""
        motion_pp = self._witness() if self.moved else None
        if motion_pp is not None:
            raise RigError(
                f"{self._wire.url}: it reports rest ({state_text(state)}), and the acquisition device sees it move by "
                f"{1e3 * motion_pp:.3g} mm peak to peak"
            )

    def _see_that_it_stopped(self, unknown: ActuatorNotAtRestError) -> None:
        """Return if the actuator is seen at rest now; where there is no watchdog, hydraulics have to be off, too.

        Raises `unknown` where that is not seen.
        """
        stopped = POWERLESS if Lack.WATCHDOG in self._wire.map.lacks else AT_REST
        judge, progress = RestJudge(time.monotonic()), StopProgress.STOPPING
        try:
            while progress is StopProgress.STOPPING:
                reading = self._wire.urgent_reading(COIL_TIME)
                progress = judge.judge(reading.status, time.monotonic())
                time.sleep(POLL)
            if progress is StopProgress.RESTS and reading.ours and reading.status.state in stopped:
                self._check_with_witness(reading.status.state)
                self._report(reading.status)
                return
        except RigError as error:
            log.info("rest is not confirmed: %s", error)
        self._leave_to_watchdog(unknown)
        raise unknown
