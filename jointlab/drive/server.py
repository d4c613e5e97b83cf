"""Serving the programs that steer the rig: a thread for each connection, few connections, and nothing is queued.

A program that reads slowly delays nobody: events stay in the journal, which drops the oldest, and its thread reads on
from there when the program has taken the last ones. The thread of the run waits for none of them.
"""

import logging
import select
import socket
import threading
import time
from collections.abc import Callable
from contextlib import closing, suppress
from functools import partial
from typing import Any, BinaryIO

from jointlab.drive.endpoint import Endpoint
from jointlab.drive.protocol import (
    EXAMINED,
    INPUT_RANGE,
    INTERLOCKS,
    LIVE_BLOCK,
    LONGEST_REQUEST,
    REPORTED_ERRORS,
    SNAPSHOT,
    WELCOME,
    Acknowledge,
    AnswerPrompt,
    Ask,
    AskInputRange,
    AskOutcome,
    Begin,
    DriveRequest,
    End,
    EndLease,
    Examine,
    FailPrompt,
    Follow,
    Hello,
    LookAtChannel,
    News,
    Pause,
    ProtocolError,
    Quit,
    Reply,
    ResetStop,
    Resume,
    StopNow,
    TakeLease,
    Welcome,
    Withdraw,
    request_of,
)
from jointlab.drive.rig import DrivenRig
from jointlab.errors import ConflictError
from rig.errors import UNEXPECTED, RigError, with_notes
from store.version import release

CONNECTIONS = 48
SHORT = 65_536
"""Bytes of a request at most while the rig works: no other thread, STOP included, runs while a document is parsed."""
SILENCE = 10.0  # s without a request, after which a session counts as gone: its program hangs or is dead
SEND_TIMEOUT = 5.0  # s that a program may leave its news unread before it is dropped
NEWS_INTERVAL = 0.25  # s, the longest time between STOP and the news of it if no event reports it
NEWS_AT_ONCE = 200  # events in one line
STOP_TIMEOUT = 10.0  # s that a STOP waits for the actuator at rest
log = logging.getLogger(__name__)


class DriveServer:
    """Answers at `endpoint` until it is closed.

    Args:
        stop_listener: address and port of it.
        quit_: ends the process.
    """

    def __init__(
        self, rig: DrivenRig, endpoint: Endpoint, stop_listener: tuple[str, int], quit_: Callable[[], object]
    ) -> None:
        self._rig = rig
        self._endpoint = endpoint
        self._stop_listener = stop_listener
        self._quit = quit_
        self._lock = threading.Lock()
        self._all_sent = threading.Condition(self._lock)
        self._following = 0
        self._connections = set[socket.socket]()
        self._sessions = dict[socket.socket, float]()  # when each was heard last
        self._driver: socket.socket | None = None  # the session that took the lease
        self._alone_since = time.monotonic()
        self._closed = False
        self._thread = threading.Thread(target=self._accept, name="drive server", daemon=True)
        self._thread.start()

    def alone(self) -> float:
        """Seconds since the last program that steers the rig was heard; 0 while one is there."""
        now = time.monotonic()
        with self._lock:
            if any(now - heard < SILENCE for heard in self._sessions.values()):
                self._alone_since = now
            return now - self._alone_since

    def close(self) -> None:
        """Stop answering; followers get every event until now."""
        self._closed = True
        with suppress(OSError):
            self._endpoint.socket.shutdown(socket.SHUT_RDWR)  # wakes the accepting thread
        self._endpoint.close()
        self._thread.join()
        with self._lock:
            self._all_sent.wait_for(lambda: not self._following, SEND_TIMEOUT)
            for connection in self._connections:
                with suppress(OSError):
                    connection.shutdown(socket.SHUT_RDWR)

    def _accept(self) -> None:
        while not self._closed:
            try:
                connection, _ = self._endpoint.socket.accept()
            except OSError as error:
                if not self._closed:
                    log.warning("drive server: %s", error)
                    time.sleep(0.1)
                continue
            with self._lock:
                if full := len(self._connections) >= CONNECTIONS:
                    log.warning("drive server: %s connections are open, one more was refused", CONNECTIONS)
                else:
                    self._connections.add(connection)
            if full:
                connection.close()
            else:
                threading.Thread(target=self._serve, args=(connection,), name="drive client", daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        try:
            with closing(connection), connection.makefile("rb") as lines:
                if not self._endpoint.is_welcome(connection):
                    return
                while (request := self._read(lines)) is not None:
                    self._heard(connection)
                    connection.sendall(self._reply(connection, *request).model_dump_json().encode() + b"\n")
        except OSError:
            pass  # it has gone
        finally:
            self._gone(connection)

    def _heard(self, connection: socket.socket) -> None:
        with self._lock:
            if connection in self._sessions:
                self._sessions[connection] = time.monotonic()

    def _gone(self, connection: socket.socket) -> None:
        with self._lock:
            self._connections.discard(connection)
            if self._sessions.pop(connection, None) is not None:
                self._alone_since = time.monotonic()
            if self._driver is connection:  # in one step, so that it takes no lease from a program that comes next
                self._driver = None
                self._rig.take_lease(None)

    def _read(self, lines: BinaryIO) -> tuple[bytes, int] | None:
        """The next line and its length; None at the end of the connection.

        While the rig works, the text of a line of more than `SHORT` bytes is dropped, and empty here.
        """
        line = lines.readline(SHORT)
        length, end = len(line), line
        if length == SHORT and not line.endswith(b"\n"):
            if self._rig.may_move:
                line = b""
                while end and not end.endswith(b"\n") and length < LONGEST_REQUEST:
                    end = lines.readline(SHORT)
                    length += len(end)
            else:
                end = lines.readline(LONGEST_REQUEST - length)
                line, length = line + end, length + len(end)
        return (line, length) if end.endswith(b"\n") else None

    def _reply(self, connection: socket.socket, line: bytes, length: int) -> Reply:
        request: DriveRequest | None = None
        try:
            if not line or (length > SHORT and self._rig.may_move):
                raise ConflictError(f"a request of {length} bytes is not looked at while the rig works")
            request = request_of(line)
            if isinstance(request, Follow):
                self._send_all_news(connection, request)
            value = self._do(connection, request)
        except REPORTED_ERRORS as error:
            said = with_notes(str(error), error)
            return Reply(latest=self._rig.journal.latest, error=type(error).__name__, text=said)
        except Exception as error:
            if isinstance(error, OSError) and isinstance(request, Follow):
                raise  # the connection, to which the news go
            log.exception("a request ended with an unexpected error: %.200r", line)
            return Reply(latest=self._rig.journal.latest, error="RigError", text=with_notes(UNEXPECTED, error))
        return Reply(latest=self._rig.journal.latest, value=value)

    def _do(self, connection: socket.socket, request: DriveRequest) -> Any:
        """Do what is asked for; returns the value of the reply as JSON has it."""
        rig = self._rig
        match request:
            case Hello():
                return self._welcome(connection, request)
            case TakeLease(holder=holder, by_force=by_force):
                return self._take_lease(connection, holder, by_force)
            case EndLease():
                self._end_lease(connection)
            case Begin(order=order, limits=limits, lease=lease, stop_epoch=stop_epoch):
                rig.begin(order, limits, lease, partial(_has_gone, connection), stop_epoch=stop_epoch)
            case Pause(run_id=run_id):
                return rig.pause(run_id)
            case Resume(run_id=run_id, lease=lease, pause=pause):
                rig.resume(run_id, lease, pause)
            case End(run_id=run_id, who=who):
                rig.end(run_id, who=who)
            case StopNow(who=who, why=why):
                return self._stop(who, why)
            case ResetStop(epoch=epoch, lease=lease):
                rig.reset_stop(epoch, lease)
            case Acknowledge(lease=lease):
                return INTERLOCKS.dump_python(rig.acknowledge(lease), mode="json")
            case Examine(asked=asked, lease=lease):
                return EXAMINED.dump_python(rig.examine(asked, lease), mode="json")
            case LookAtChannel(channel=channel, lease=lease):
                return LIVE_BLOCK.dump_python(rig.look(channel, lease), mode="json")
            case AskInputRange(channel=asked_for, lease=lease):
                return INPUT_RANGE.dump_python(rig.input_range(asked_for, lease), mode="json")
            case AnswerPrompt(run_id=run_id, prompt=prompt, lease=lease):
                rig.answer(run_id, prompt, lease)
            case FailPrompt(run_id=run_id, prompt=prompt, reason=reason):
                rig.fail_prompt(run_id, prompt, reason)
            case Withdraw(run_id=run_id, set_number=number, point=point, blow=blow, reason=reason):
                rig.withdraw(run_id, number, point, blow, reason)
            case AskOutcome():
                rig.check_outcome()
            case Ask():
                return SNAPSHOT.dump_python(rig.snapshot(), mode="json")
            case Quit():
                if rig.is_at_work:
                    raise ConflictError("a run is in progress; stop it first")
                self._quit()
        return None

    def _welcome(self, connection: socket.socket, hello: Hello) -> Any:
        if hello.release != release():
            raise ProtocolError(
                f"{hello.name} is version {hello.release}, the drive process {release()}; end the drive process when "
                "the rig is at rest, and start it again"
            )
        with self._lock:
            self._sessions[connection] = time.monotonic()
        address, port = self._stop_listener
        rig = self._rig
        welcome = Welcome(rig.journal.epoch, rig.name, rig.lease, rig.tester_url, address, port, rig.channels)
        return WELCOME.dump_python(welcome, mode="json")

    def _take_lease(self, connection: socket.socket, holder: str | None, by_force: bool) -> int:
        with self._lock:
            if connection not in self._sessions:
                raise ConflictError("only a session drives the rig; say hello first")
            other = self._driver not in (None, connection)
            if other and not by_force:
                raise ConflictError(f"{self._rig.snapshot().holder} drives the rig from another program")
            self._driver = None if holder is None else connection
            return self._rig.take_lease(holder)

    def _end_lease(self, connection: socket.socket) -> None:
        with self._lock:
            if self._driver is connection:
                self._driver = None
                self._rig.end_lease()

    def _stop(self, who: str, why: str) -> int | None:
        state = self._rig.snapshot().state
        run_id = state.run_id if self._rig.is_at_work else None
        outcome = self._rig.halter.wait(self._rig.halter.press(who, why), STOP_TIMEOUT)
        if outcome is None:
            raise RigError("STOP is latched; the actuator was not confirmed at rest yet")
        if outcome.at_rest is False:
            raise RigError(outcome.detail)
        return run_id

    def _send_all_news(self, connection: socket.socket, follow: Follow) -> None:
        """Send all news until the program has gone, or does not read."""
        with self._lock:
            self._following += 1
        try:
            self._send_news(connection, follow)
        finally:
            with self._lock:
                self._following -= 1
                self._all_sent.notify_all()

    def _send_news(self, connection: socket.socket, follow: Follow) -> None:
        journal = self._rig.journal
        connection.settimeout(SEND_TIMEOUT)
        told = follow.after if follow.epoch == journal.epoch else 0
        shown = None
        while True:
            is_last = self._closed
            entries = journal.after(told)[:NEWS_AT_ONCE] or journal.wait(told, NEWS_INTERVAL)[:NEWS_AT_ONCE]
            snapshot = self._rig.snapshot()
            if not entries and snapshot == shown:
                if is_last or _has_gone(connection):
                    break
                continue
            told, shown = (entries[-1].number if entries else told), snapshot
            news = News(epoch=journal.epoch, entries=tuple(entries), snapshot=snapshot)
            connection.sendall(news.model_dump_json().encode() + b"\n")
        raise ConnectionAbortedError("nothing follows any more")


def _has_gone(connection: socket.socket) -> bool:
    """Whether the program at the other end has closed its connection; it sends nothing more while it waits."""
    return bool(select.select([connection], [], [], 0.0)[0]) and not connection.recv(1, socket.MSG_PEEK)
