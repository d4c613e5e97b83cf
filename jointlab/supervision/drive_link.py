"""The link of a program to the drive process of its rig: requests, and the news of what happens there.

Where no process answers, a program that may start one does so, also after a process was killed. Nothing here waits for
a database.
"""

import logging
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path
from typing import BinaryIO

from jointlab.drive.endpoint import NoDriveError, UnansweredError, connect
from jointlab.drive.process import LOG
from jointlab.drive.protocol import (
    LONGEST_REQUEST,
    WELCOME,
    Ask,
    DriveRequest,
    EndLease,
    Follow,
    Hello,
    News,
    Quit,
    Reply,
    StopNow,
    TakeLease,
    Welcome,
    error_of,
)
from jointlab.errors import ConflictError
from jointlab.settings import Settings, drive_folder
from rig.errors import RigError
from store.version import release

START_TIMEOUT = 60.0  # s that a drive process may take to start; it imports for seconds on a busy machine
ANSWER_TIMEOUT = 15.0  # s
PING_INTERVAL = 2.0  # s between two signs of life
RETRY = 0.3  # s between two attempts to find a process that has gone
TAIL = 400  # last characters of what the process printed (`OUTPUT`) that an error shows
SETTINGS, OUTPUT = "settings.json", "drive.output"
"""Files in the folder of a process that is started here: its settings, and what it prints."""
NEEDED = {
    "rig", "daq_address", "tester_url", "tester_map", "tester_without", "external_patience", "thermometer_url",
    "channels", "drive", "log",
}  # fmt: skip
"""The fields of the settings that a drive process has; it knows no database."""
REPEATABLE = (StopNow, Ask)
"""Requests that do no harm where they are done twice."""
STATE_UNKNOWN = "what the machine does is not known: keep away from it, and press the red button"
log = logging.getLogger(__name__)


class DriveLink:
    """The link to the drive process of `settings`, until it is closed. Any thread may call it.

    Args:
        name: of this program, for the messages of others.
        heard: gets all news, from a thread of its own.
        lost: gets the reason when the process does not answer any more.
        found: gets the greeting of another process that answers in its place.
        starts: whether a process is started where none answers, and ended with the link.

    Raises:
        RigError: no process answers, or it is of another version.
    """

    def __init__(
        self,
        settings: Settings,
        name: str,
        heard: Callable[[News], object],
        lost: Callable[[str], object],
        found: Callable[[Welcome], object],
        *,
        starts: bool = True,
    ) -> None:
        self.folder = drive_folder(settings)
        self._settings = settings
        self._name = name
        self._heard = heard
        self._lost = lost
        self._found = found
        self._starts = starts
        self._process: subprocess.Popen[bytes] | None = None  # that was started here
        self._closed = threading.Event()
        self._wake = threading.Event()  # where the process seems lost, or the link is closed
        self._lock = threading.Lock()
        self._session = self._open_session(START_TIMEOUT)
        self._following: _Line | None = None
        self._is_lost = False
        self._has_news = False  # whether news came since the connection for them was lost
        self._epoch: str | None = None  # of the journal that is followed
        self._latest = 0  # number of the latest event that was passed on
        self._threads = [
            threading.Thread(target=work, name=name, daemon=True)
            for work, name in ((self._follow, "drive news"), (self._keep, "drive session"))
        ]
        for thread in self._threads:
            thread.start()

    @property
    def is_owner(self) -> bool:
        """Whether this program has started the process."""
        return self._process is not None

    @property
    def welcome(self) -> Welcome:
        """The greeting of the process, with its addresses."""
        return self._session[1]

    def ask(self, request: DriveRequest, timeout: float = ANSWER_TIMEOUT) -> Reply:
        """The reply to a request, on a connection of its own, so that no request waits for another.

        A process whose places are all taken drops the connection; what may be done twice is then sent again.

        Raises NoDriveError where no process answers within `timeout` s, UnansweredError where it has the request;
        the error in the reply, where there is one.
        """
        end = time.monotonic() + timeout
        dropped: NoDriveError | None = None
        while True:
            try:
                line = _Line(self.folder, end - time.monotonic())
            except NoDriveError:
                if dropped is not None:
                    raise dropped from None
                raise
            with closing(line):
                try:
                    return line.ask(request)
                except NoDriveError as error:
                    if not isinstance(request, REPEATABLE) or time.monotonic() + RETRY > end:
                        raise
                    dropped = error
            time.sleep(RETRY / 10)

    def take_lease(self, holder: str | None, *, by_force: bool = False) -> int:
        """Let `holder` drive through this program, and no other; returns the number of the lease.

        Raises ConflictError where another program drives and `by_force` is not given; NoDriveError.
        """
        with self._lock:
            return int(self._session[0].ask(TakeLease(holder=holder, by_force=by_force)).value)

    def end_lease(self) -> None:
        """Let other programs take the lease, which has ended by itself. Raises NoDriveError."""
        with self._lock:
            self._session[0].ask(EndLease())

    def close(self) -> None:
        """End the link, and a process that it has started, where no run is carried out."""
        self._closed.set()
        self._wake.set()
        if self._process is not None:
            # a run is carried out, or it is dead, or takes too long
            with suppress(ConflictError, RigError, OSError, subprocess.TimeoutExpired):
                self.ask(Quit())
                self._process.wait(ANSWER_TIMEOUT)
        with self._lock:
            self._session[0].close()
            if self._following is not None:
                self._following.close()
        for thread in self._threads:
            thread.join()

    def _open_session(self, patience: float) -> "tuple[_Line, Welcome]":
        end = time.monotonic() + patience
        while True:
            try:
                line = _Line(self.folder, ANSWER_TIMEOUT)
                try:
                    return line, self._checked(line.ask(Hello(release=release(), name=self._name)))
                except BaseException:
                    line.close()
                    raise
            except NoDriveError:
                if not self._starts or self._closed.is_set() or time.monotonic() > end:
                    raise
                self._start()
                time.sleep(RETRY / 10)

    def _checked(self, reply: Reply) -> Welcome:
        welcome = WELCOME.validate_python(reply.value)
        if welcome.tester_url != self._settings.tester_url:
            raise RigError(
                f"the drive process of {self.folder} drives {welcome.tester_url}, not {self._settings.tester_url}; end "
                "it when the rig is at rest, or name another folder in [drive]"
            )
        return welcome

    def _start(self) -> None:
        """Start the process, unless one that was started here still runs.

        Raises RigError where the one before ended at once with an error, or none can be started.
        """
        if self._process is not None and self._process.poll() is None:
            return
        if self._process is not None and self._process.returncode > 0:
            said = self._said()
            self._process = None
            raise RigError(f"the drive process did not start: {said}")
        given = self.folder / SETTINGS
        alarms = ["alarms"] if self._settings.alarms.are_told else []
        try:
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            given.write_text(self._settings.model_dump_json(include=NEEDED), encoding="utf-8")
            with (self.folder / OUTPUT).open("wb") as output:
                self._process = subprocess.Popen(
                    [sys.executable, "-m", "jointlab.drive", str(given), *alarms],
                    stdin=subprocess.DEVNULL, stdout=output, stderr=output, start_new_session=True,
                )  # fmt: skip
        except OSError as error:
            raise RigError(
                f"the drive process cannot be started: {error}; make room for it on disk and in memory, and see that "
                f"{self.folder} can be written"
            ) from error

    def _said(self) -> str:
        with suppress(OSError):
            return (self.folder / OUTPUT).read_text(encoding="utf-8", errors="replace").strip()[-TAIL:]
        return f"see {self.folder / LOG}"

    def _follow(self) -> None:
        """Pass the news on until the link is closed; connect again where the connection is lost."""
        while not self._closed.is_set():
            try:
                self._pass_news_on()
            except (NoDriveError, ValueError) as error:
                if self._closed.is_set():
                    return
                if not self._is_lost:  # then a better reason may be told already
                    self._tell_lost(str(error))
                if self._has_news:  # the first time only; then `_keep` asks at its own interval
                    self._has_news = False
                    self._wake.set()
                self._closed.wait(RETRY)

    def _pass_news_on(self) -> None:
        """Pass the news of one connection on. Raises NoDriveError where it is lost, ValueError for a damaged line."""
        with closing(_Line(self.folder, ANSWER_TIMEOUT)) as line:
            self._following = line
            line.send(Follow(epoch=self._epoch, after=self._latest))
            line.wait_without_limit()
            while not self._closed.is_set():
                news = News.model_validate_json(line.read())
                if news.epoch != self._epoch:
                    self._epoch, self._latest = news.epoch, 0
                self._latest = news.entries[-1].number if news.entries else self._latest
                self._has_news, self._is_lost = True, False
                self._heard(news)

    def _keep(self) -> None:
        """Keep the session, and open a new one where it is lost."""
        while not self._closed.is_set():
            self._wake.wait(PING_INTERVAL)
            if self._closed.is_set():
                return
            self._wake.clear()
            try:
                with self._lock:
                    self._session[0].ask(Ask())
            except RigError as error:
                if not self._is_lost:
                    self._tell_lost(str(error))
                self._reopen()
                self._follow_again()

    def _tell_lost(self, why: str) -> None:
        self._is_lost = True
        self._lost(why)

    def _follow_again(self) -> None:
        """Connect for the news once more: the first of them say what the process does now."""
        if self._following is not None:
            self._following.end()

    def _reopen(self) -> None:
        try:
            found = self._open_session(START_TIMEOUT)
        except RigError as error:
            log.warning("%s", error)
            self._tell_lost(str(error))
            return
        with self._lock:
            self._session[0].close()
            self._session = found
        self._found(found[1])


class _Line:
    """One connection. Raises NoDriveError where it is lost or an answer takes too long."""

    def __init__(self, folder: Path, timeout: float) -> None:
        self._socket = connect(folder, timeout)
        self._lines: BinaryIO = self._socket.makefile("rb")

    def wait_without_limit(self) -> None:
        """Let each read wait as long as it takes, from now on."""
        try:
            self._socket.settimeout(None)
        except OSError as error:  # it was closed meanwhile
            raise NoDriveError(f"the connection to the drive process was closed ({error})") from error

    def send(self, request: DriveRequest) -> None:
        """Send a request."""
        try:
            self._socket.sendall(request.model_dump_json().encode() + b"\n")
        except OSError as error:
            raise NoDriveError(f"the drive process does not answer ({error}); {STATE_UNKNOWN}") from error

    def read(self) -> bytes:
        """The next line."""
        try:
            line = self._lines.readline(LONGEST_REQUEST)
        except (OSError, ValueError) as error:
            raise NoDriveError(f"the drive process does not answer ({error}); {STATE_UNKNOWN}") from error
        if not line.endswith(b"\n"):
            raise NoDriveError(f"the drive process has ended; {STATE_UNKNOWN}")
        return line

    def ask(self, request: DriveRequest) -> Reply:
        """The reply to a request; raises the error in it, UnansweredError where it was sent and none comes."""
        self.send(request)
        try:
            line = self.read()
        except NoDriveError as error:
            raise UnansweredError(str(error)) from error
        reply = Reply.model_validate_json(line)
        if reply.error is not None:
            raise error_of(reply)
        return reply

    def end(self) -> None:
        """Let a thread that reads find the end of the connection."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """End the connection, also where another thread reads."""
        self.end()
        self._lines.close()
        self._socket.close()
