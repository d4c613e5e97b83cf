"""The drive process of one rig, put together: its lock, the rig, STOP, and the server for programs that steer it."""

import ctypes
import gc
import json
import logging
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from hashlib import sha256
from logging.handlers import RotatingFileHandler
from pathlib import Path
from types import FrameType

from jointlab.drive.endpoint import Endpoint
from jointlab.drive.rig import DrivenRig
from jointlab.drive.server import DriveServer
from jointlab.drive.stop_button import StopButton
from jointlab.drive.stop_listener import StopListener
from jointlab.errors import JointlabError
from jointlab.instruments import instruments_of
from jointlab.logs import LogSettings, write_logs
from jointlab.settings import Settings, drive_folder, state_folder
from rig.errors import RigError
from rig.spool import spooling
from store.errors import StoreError
from store.file_lock import LockHeldError, exclusive_lock
from store.provenance import who_is_here

LOCK, HOLDER, STOP_ADDRESS, LOG, SPOOLS = "drive.lock", "drive.holder", "stop.json", "drive.log", "spools"
"""Files in the folder of the process, and the folder of its spools."""
TICK = 0.1  # s between two looks at signals and at who is there
ALONE = 5.0  # s without a program that steers, after which a run may be ended
LINGER = 30.0  # s, after which a process that the service has started ends, where nothing is carried out
SWITCH = 1e-3  # s that one thread may keep the others waiting
LOG_SIZE, LOGS = 2**20, 3
LOCK_MEMORY = 1 | 2 | 4  # MCL_CURRENT, MCL_FUTURE, MCL_ONFAULT of Linux: what was used once is never swapped out
log = logging.getLogger(__name__)


class DriveBusyError(StoreError):
    """Another living process drives the rig."""


class Drive:
    """One rig, driven until the context of `driving` is left.

    Attributes:
        rig: the rig.
        server, listener: for programs that steer, and for STOP.
        wants_to_end: whether it was asked to end.
    """

    def __init__(self, settings: Settings, held: ExitStack) -> None:
        folder = drive_folder(settings)
        given = settings.drive
        self.wants_to_end = False
        self.rig = DrivenRig(instruments_of(settings), partial(spooling, folder / SPOOLS))
        held.callback(self.rig.close)
        try:
            self.listener = StopListener(given.stop_address, given.stop_port, self.rig.halter, self.describe)
        except OSError as error:
            raise JointlabError(
                f"STOP cannot listen on port {given.stop_port} of {given.stop_address}: {error.strerror}; write "
                "another stop_port into [drive] of jointlab.toml"
            ) from error
        held.callback(self.listener.close)
        if given.stop_button is not None:
            held.callback(StopButton(given.stop_button, self.rig.halter.press).close)
        listens = (given.stop_address, self.listener.port)
        (folder / STOP_ADDRESS).write_text(json.dumps(listens), encoding="ascii")
        self.server = DriveServer(self.rig, Endpoint(folder), listens, self._end)
        held.callback(self.server.close)
        held.callback(self._end_run)  # first, while programs still hear of it

    def describe(self) -> dict[str, object]:
        """What the machine does, for those who ask the STOP listener."""
        shown = self.rig.snapshot()
        stop = None if shown.stop is None else {"epoch": shown.stop.epoch, "who": shown.stop.who, "why": shown.stop.why}
        return {"rig": self.rig.name, "phase": shown.state.phase, "run_id": shown.state.run_id, "stop": stop}

    def _end_run(self) -> None:
        with suppress(RigError):  # it is in the log, and the rig is closed afterwards
            self.rig.end_safely("the drive process is ended")

    def _end(self) -> None:
        self.wants_to_end = True


@contextmanager
def driving(settings: Settings) -> Iterator[Drive]:
    """Drive the rig of `settings` until the context is left, which ends its run with the actuator at rest.

    Raises:
        DriveBusyError: another process drives it; the message names it.
        JointlabError: the channel table is empty, or STOP cannot listen.
        StoreError, RigError: its folder cannot be used.
    """
    folder = drive_folder(settings)
    with ExitStack() as held:
        held.enter_context(_lock(folder / LOCK, folder / HOLDER, settings))
        if settings.tester_url is not None:  # the same tester by another name or from another folder
            name = sha256(settings.tester_url.encode()).hexdigest()[:16]
            held.enter_context(_lock(state_folder() / f"tester-{name}.lock", folder / HOLDER, settings))
        yield Drive(settings, held)


@contextmanager
def _lock(path: Path, holder: Path, settings: Settings) -> Iterator[None]:
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with exclusive_lock(path):
            holder.write_text(who_is_here(), encoding="utf-8")
            yield
    except LockHeldError as error:
        named = holder.read_text(encoding="utf-8") if holder.is_file() else "another process"
        raise DriveBusyError(f"{settings.rig!r} is driven by {named}; end that process first") from error
    except OSError as error:
        raise StoreError(f"{error.filename} cannot be written: {error.strerror}") from error


def run(settings: Settings, *, until_alone: bool = False) -> None:
    """Be the drive process until a signal or a program asks for its end.

    Args:
        settings: with the rig's instruments.
        until_alone: also end where no run is carried out and no program steers any more.

    Raises:
        DriveBusyError, JointlabError, StoreError, RigError: as for `driving`.
    """
    with driving(settings) as drive, _signals(drive):
        _log_to(drive_folder(settings) / LOG, settings.log)
        _be_first()
        log.info("process %s drives %r, STOP on port %s", os.getpid(), settings.rig, drive.listener.port)
        while not drive.wants_to_end:
            time.sleep(TICK)
            alone = drive.server.alone()
            if drive.rig.is_at_work:
                if settings.drive.when_alone == "stop" and alone > ALONE:
                    with suppress(RigError):  # it is in the log, and so is what comes after it
                        drive.rig.end_safely("no program steers the rig any more")
            elif until_alone and alone > LINGER:
                return


@contextmanager
def _signals(drive: Drive) -> Iterator[None]:
    """End safely when a signal asks for it; a terminal that is closed is no reason."""

    def end(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - a handler is given both
        drive.wants_to_end = True

    handlers = {signal.SIGTERM: end, signal.SIGINT: end}
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    if sys.platform != "win32":
        before[signal.SIGHUP] = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _log_to(file: Path, settings: LogSettings) -> None:
    write_logs(settings, RotatingFileHandler(file, maxBytes=LOG_SIZE, backupCount=LOGS, encoding="utf-8"))


def _be_first() -> None:
    """Come before other processes where the system allows it, and let nothing pause this one."""
    sys.setswitchinterval(SWITCH)
    gc.collect()
    gc.freeze()  # later collections look at what is new
    if sys.platform != "win32":
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, 0, -10)
    if sys.platform == "linux" and os.geteuid() == 0:  # others may lock too little to be safe from a failing allocation
        ctypes.CDLL(None).mlockall(LOCK_MEMORY)
