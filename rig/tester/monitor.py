"""Monitoring the tester: at short intervals while a run drives it, and by a single poll while no run does.

While the operator mounts, and may reach into the machine, the tester is polled every 2 s: its pressure has to be off.

A record takes up to twelve seconds, a locked store or a silent thermometer delays the run, a pause has no end, and the
actuator has pressure throughout. Polling does not disturb a record: the acquisition device takes its samples by
itself, and the tester has a line of its own.
"""

import logging
import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from functools import partial

from rig.errors import RigError
from rig.tester.driver import Tester
from rig.tester.modbus import ModbusLink
from rig.tester.register_map import OURS, TesterMap
from rig.tester.rest_judge import LOOKS_APART, POWERLESS, RestJudge, StopProgress
from rig.tester.status import MotionHaltedError, TesterStatus, state_text
from rig.tester.wire import TesterWire

INTERVAL = 0.1  # s, between two polls while a run drives
LOOK_INTERVAL = 2.0  # s, between two looks at a tester that no run drives, or while the operator mounts
MISSES = 2  # looks in a row without an answer before that is told, as one answer may have been garbled
TIMEOUT = 0.25  # s, of connecting and of the reply to a single poll, so that the next client has the line soon

log = logging.getLogger(__name__)


class Monitor:
    """Limits the time that the run may spend on anything else than the tester."""

    def __init__(self) -> None:
        self._due: tuple[float, str] = (math.inf, "")

    @contextmanager
    def within(self, seconds: float, reason: str) -> Iterator[None]:
        """Shut the tester down for `reason` if the context lasts longer than `seconds`."""
        self._due = (time.monotonic() + seconds, reason)
        try:
            yield
        finally:
            self._due = (math.inf, "")

    def check(self) -> None:
        """Raise RigError if the context of `within` lasts too long."""
        due, reason = self._due
        if time.monotonic() > due:
            raise RigError(reason)


@contextmanager
def monitored(tester: Tester) -> Iterator[Monitor]:
    """Poll `tester` every `INTERVAL` s while the context lasts, and shut it down at once where something is wrong.

    `Tester.measured` decides: an interlock, a limit of the rig, a tester that does not answer or that another client
    commands; and `Monitor.within`. Every later request of the run to the tester then raises that error.

    Raises:
        RigError: on leaving, that error; an error raised inside the context has precedence.
    """
    monitor = Monitor()
    with _watching(tester, partial(_poll, tester, monitor)):
        yield monitor


@contextmanager
def kept_without_pressure(tester: Tester, meanwhile: str) -> Iterator[None]:
    """Look at `tester`, whose hydraulics are off, every `LOOK_INTERVAL` s while the context lasts.

    Where anybody has switched them on, or where it does not answer `MISSES` times in a row, it is given up at once, and
    shut down as often as they are on again.

    Args:
        meanwhile: what is done in the context, such as "the operator mounts".

    Raises:
        RigError: on leaving, why it was given up; an error raised inside the context has precedence.
    """
    with _watching(tester, partial(_keep_without_pressure, tester, meanwhile)):
        yield


@contextmanager
def _watching(tester: Tester, watch: Callable[[threading.Event], None]) -> Iterator[None]:
    """Run `watch` in a thread of its own until the context is left, which sets its event."""
    over = threading.Event()
    thread = threading.Thread(target=watch, args=(over,), name="tester monitor", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
    if tester.failure is not None:
        raise tester.failure


def _poll(tester: Tester, monitor: Monitor, over: threading.Event) -> None:
    while not over.wait(INTERVAL):
        try:
            monitor.check()
            tester.measured()
        except MotionHaltedError:
            continue  # it was halted as asked; limits and interlocks are checked all the same
        except Exception as error:  # noqa: BLE001 - after any error nothing would monitor the tester any more
            log.warning("the tester is shut down: %s", error)
            _give_up(tester, error)
            return


def _keep_without_pressure(tester: Tester, meanwhile: str, over: threading.Event) -> None:
    misses = 0
    while not over.wait(LOOK_INTERVAL):
        trouble = None
        try:
            state = tester.looked_at().state
        except Exception as error:  # noqa: BLE001 - after any error nothing would poll the tester any more
            misses += 1
            if misses >= MISSES:
                trouble = f"the tester did not answer while {meanwhile} ({error})"
        else:
            misses = 0
            if state not in POWERLESS:
                trouble = f"hydraulics were switched on ({state_text(state)}) while {meanwhile}"
        if trouble is not None:
            log.warning("the tester is shut down: %s", trouble)
            _give_up(tester, tester.failure or RigError(trouble))


def _give_up(tester: Tester, why: Exception) -> None:
    try:
        tester.give_up(why)
    except RigError as error:
        log.warning("%s", error)  # the run, which ends now, shuts down once more and raises it


def poll_tester(url: str, tester_map: TesterMap = OURS) -> TesterStatus:
    """The status of the tester at `url`, read once by a process that does not drive it.

    One read of its status: nothing is commanded, armed or reset, and no heartbeat is sent, so the watchdog is not
    affected. The connection is closed again, for an instrument or a serial line that takes one client at a time. Raises
    RigError where it does not answer within `TIMEOUT`, or not with a status.
    """
    with closing(ModbusLink(url, TIMEOUT, tester_map.codec)) as link:
        return TesterWire(link, tester_map).poll()


def is_seen_at_rest(url: str, tester_map: TesterMap = OURS) -> bool:
    """Whether the actuator of the tester at `url` rests, as a stop would see it; for a process that does not drive it.

    Nothing is commanded; it takes as long as `RestJudge` allows a stop at most, and the reply to one status. Raises
    RigError where the tester does not answer.
    """
    with closing(ModbusLink(url, TIMEOUT, tester_map.codec)) as link:
        wire, judge = TesterWire(link, tester_map), RestJudge(time.monotonic())
        while (progress := judge.judge(wire.status(), time.monotonic())) is StopProgress.STOPPING:
            time.sleep(LOOKS_APART)
    return progress is StopProgress.RESTS
