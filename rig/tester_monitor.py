"""A second pair of eyes on the tester: they look at it at short intervals, whatever the run itself is busy with.

A record takes up to twelve seconds, a locked store or a silent thermometer holds the run up, a pause lasts for as long
as somebody likes; the actuator has pressure all the while. Looking costs the record nothing: the instrument gathers its
samples by itself, and the tester has a line of its own.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager

from rig.errors import RigError
from rig.modbus import ModbusLink
from rig.registers import STATUS, ChecksumError
from rig.tester import Tester
from rig.tester_status import MotionHaltedError, TesterStatus, status_from

INTERVAL = 0.1  # s, between two looks

log = logging.getLogger(__name__)


@contextmanager
def monitored(tester: Tester) -> Iterator[None]:
    """Look at `tester` every `INTERVAL` s while the context lasts, and shut it down at once where something is wrong.

    Wrong is what `Tester.measured` does not let pass: an interlock, a limit of the rig, a tester that does not answer
    or that somebody else commands. Whatever the run asks of the tester then is answered with that.

    Raises:
        RigError: on leaving, what was wrong; an error that is on its way out already stays the one that is raised.
    """
    over = threading.Event()
    watch = threading.Thread(target=_look_on, args=(tester, over), name="tester watch", daemon=True)
    watch.start()
    try:
        yield
    finally:
        over.set()
        watch.join()
    if tester.failure is not None:
        raise tester.failure


def _look_on(tester: Tester, over: threading.Event) -> None:
    while not over.wait(INTERVAL):
        try:
            tester.measured()
        except MotionHaltedError:
            continue  # somebody has stopped it, and limits and interlocks are looked at all the same
        except Exception as error:  # noqa: BLE001 - whatever it is, nobody would look any more
            log.warning("the tester is shut down: %s", error)
            _give_up(tester, error)
            return


def _give_up(tester: Tester, why: Exception) -> None:
    try:
        tester.give_up(why)
    except RigError as error:
        log.warning("%s", error)  # the run, which ends now, shuts down once more and raises it


TIMEOUT = 0.25  # s, of connecting and of the reply, so that whoever wants the line next has it soon


def poll_tester(url: str) -> TesterStatus:
    """What the tester at `url` reports, asked once.

    Raises:
        RigError: it does not answer within `TIMEOUT`, or not with a status.
    """
    with closing(ModbusLink(url, timeout=TIMEOUT)) as link:
        words = link.read_input(STATUS.address, STATUS.count)
    try:
        return status_from(STATUS.unpack(words))
    except ChecksumError as error:
        raise RigError(f"{url}: {error}") from error
