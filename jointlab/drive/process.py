"""The drive process of one rig, put together: its lock, the rig, STOP, and the server for programs that steer it."""

import json
import logging
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from hashlib import sha256
from pathlib import Path
from types import FrameType

from jointlab.drive.endpoint import Endpoint
from jointlab.drive.kept_stop import KeptStop
from jointlab.drive.priority import come_first
from jointlab.drive.rig import DrivenRig
from jointlab.drive.server import DriveServer
from jointlab.drive.stop_button import StopButton
from jointlab.drive.stop_listener import StopListener
from jointlab.errors import JointlabError
from jointlab.instruments import instruments_of
from jointlab.logs import BackgroundHandler, LogFile, LogSettings, write_logs
from jointlab.settings import Settings, drive_folder, state_folder
from jointlab.systemd import SignsOfLife
from rig.errors import RigError
from rig.instruments import EXTERNAL
from rig.registers import interlock_names
from rig.runs.spool import spooling
from store.database.file_lock import LockHeldError, exclusive_lock
from store.errors import StoreError
from store.provenance import who_is_here

LOCK, HOLDER, STOP_ADDRESS, LOG, SPOOLS = "drive.lock", "drive.holder", "stop.json", "drive.log", "spools"
STOP_LATCHED = "stop.latched"
"""Files in the folder of the process, and the folder of its spools."""
TICK = 0.1  # s between two looks at signals and at who is there
ALONE = 5.0  # s without a program that steers, after which a run may be ended, and people are notified of alarms
LINGER = 30.0  # s, after which a process that the service has started ends, where nothing is carried out
LOG_SIZE, LOGS = 2**20, 3
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
        instruments = instruments_of(settings)
        held.callback(KeptStop(folder / STOP_LATCHED, instruments.latch).close)
        self.rig = DrivenRig(instruments, partial(spooling, folder / SPOOLS))
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
        """The state of the machine, for those who ask the STOP listener."""
        shown = self.rig.snapshot()
        stop = None if shown.stop is None else {"epoch": shown.stop.epoch, "who": shown.stop.who, "why": shown.stop.why}
        known = shown.state
        return {
            "rig": self.rig.name,
            "phase": known.phase,
            "run_id": known.run_id,
            "activity": known.activity,
            "reason": known.reason,
            "interlocks": interlock_names(known.interlocks),
            "tripped": known.is_tripped,
            "tester_silent": known.tester_silent,
            "rest_unknown": known.rest_unknown,
            "is_driven": known.is_driven,
            "stop": stop,
        }

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
        if settings.tester_url is not None and settings.tester_url != EXTERNAL:
            # the same tester by another name or from another folder
            held.enter_context(tester_held(settings, settings.tester_url))
        with _usable(folder):
            drive = Drive(settings, held)
        yield drive


@contextmanager
def _usable(folder: Path) -> Iterator[None]:
    """Raise an error of the system about a file of `folder` as a StoreError that names the file."""
    try:
        yield
    except OSError as error:
        raise StoreError(
            f"the drive process cannot use {error.filename or folder}: {error.strerror or error}; make room on its "
            "disk, and let this user write there"
        ) from error


@contextmanager
def tester_held(settings: Settings, url: str) -> Iterator[None]:
    """Keep every other process of this computer from driving the tester at `url` until the context is left.

    Raises DriveBusyError where one drives it, StoreError where that cannot be found out.
    """
    name = sha256(url.encode()).hexdigest()[:16]
    path = state_folder() / f"tester-{name}"
    with _lock(path.with_suffix(".lock"), path.with_suffix(".holder"), settings), _only_here(name, settings):
        yield


@contextmanager
def _lock(path: Path, holder: Path, settings: Settings) -> Iterator[None]:
    with ExitStack() as held:
        try:
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            held.enter_context(exclusive_lock(path))
            holder.write_text(who_is_here(), encoding="utf-8")
        except LockHeldError as error:
            named = holder.read_text(encoding="utf-8") if holder.is_file() else "another process"
            raise DriveBusyError(f"{settings.rig!r} is driven by {named}; end that process first") from error
        except OSError as error:
            raise StoreError(f"{error.filename} cannot be written: {error.strerror}") from error
        yield


@contextmanager
def _only_here(name: str, settings: Settings) -> Iterator[None]:
    """Hold a lock that every user of this computer sees: an abstract socket of Linux, which ends with its process."""
    if sys.platform != "linux":
        yield
        return
    with socket.socket(socket.AF_UNIX) as held:
        try:
            held.bind(f"\0jointlab-tester-{name}")
        except OSError as error:
            raise DriveBusyError(
                f"{settings.tester_url} is driven by a process of another user of this computer; end that process first"
            ) from error
        yield


def run(settings: Settings, *, until_alone: bool = False, alarms: bool = False) -> None:
    """Be the drive process until a signal or a program asks for its end.

    Args:
        settings: with the rig's instruments.
        until_alone: also end where no run is carried out and no program steers any more.
        alarms: whether a process of its own notifies people of alarms, as configured, while no program steers.

    Raises:
        DriveBusyError, JointlabError, StoreError, RigError: as for `driving`.
    """
    signs = SignsOfLife()
    alarm_process = AlarmProcess(drive_folder(settings), settings.rig) if alarms else None
    priority = come_first()  # before its threads are started
    with driving(settings) as drive, _signals(drive):
        with _usable(drive_folder(settings)):
            _log_to(drive_folder(settings) / LOG, settings.log)
        log.info(
            "process %s drives %r with %s, STOP on port %s", os.getpid(), settings.rig, priority, drive.listener.port
        )
        while not drive.wants_to_end:
            time.sleep(TICK)
            alone = drive.server.alone()
            if alarm_process is not None:
                alarm_process.set_alone(alone > ALONE)
            signs.give()
            is_at_work = drive.rig.is_at_work
            if is_at_work and settings.drive.when_alone == "stop" and alone > ALONE:
                with suppress(RigError):  # it is in the log, and so is what comes after it
                    drive.rig.end_safely("no program steers the rig any more")
            if not is_at_work and until_alone and alone > LINGER:
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
    write_logs(settings, BackgroundHandler(LogFile(file, maxBytes=LOG_SIZE, backupCount=LOGS, encoding="utf-8")))


class AlarmProcess:
    """The process that notifies people of alarms while no program steers the rig. Nothing here waits for it.

    It goes on after this process, until everything is sent. It is started once, before the rig moves and before this
    process takes its priority: a process with threads pauses for a moment when it starts another one.
    """

    def __init__(self, folder: Path, rig: str) -> None:
        command = [sys.executable, "-m", "jointlab.alarms.alone", str(folder), rig]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, bufsize=0, start_new_session=True)
        assert self.process.stdin is not None
        self._pipe = self.process.stdin
        os.set_blocking(self._pipe.fileno(), False)
        self._said: bool | None = None

    def set_alone(self, is_alone: bool) -> None:
        """Let it know whether no program steers the rig; does nothing if it has ended."""
        with suppress(BrokenPipeError):
            if is_alone is not self._said and self._pipe.write(b"1" if is_alone else b"0"):
                self._said = is_alone
