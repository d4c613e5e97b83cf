"""Monitoring the tester: at short intervals while a run drives it, and by a single poll while no run does.

A record takes up to twelve seconds, a locked store or a silent thermometer delays the run, a pause has no end, and the
actuator has pressure throughout. Polling does not disturb a record: the acquisition device takes its samples by
itself, and the tester has a line of its own.
"""

import logging
import math
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager

from rig.errors import RigError
from rig.tester.driver import Tester
from rig.tester.modbus import ModbusLink
from rig.tester.register_map import OURS, TesterMap
from rig.tester.rest_judge import LOOKS_APART, RestJudge, StopProgress
from rig.tester.status import MotionHaltedError, TesterStatus
from rig.tester.wire import TesterWire

INTERVAL = 0.1  # s, between two polls while a run drives
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
    over = threading.Event()
    monitor = Monitor()
    thread = threading.Thread(target=_poll, args=(tester, monitor, over), name="tester monitor", daemon=True)
    thread.start()
    try:
        yield monitor
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
