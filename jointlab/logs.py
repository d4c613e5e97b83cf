"""Logs of every process: level, form, and the request, run and job that a record belongs to."""

import json
import logging
import queue
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from datetime import UTC, datetime
from enum import StrEnum
from logging.handlers import QueueHandler, RotatingFileHandler
from threading import Thread
from typing import Literal

from pydantic import AnyHttpUrl, BaseModel, ConfigDict, Field

WAITING = 1_000  # records at most that wait for a slow disk
OURS = ("analysis", "api", "daq", "jointlab", "rig", "store")
"""Packages whose records obey the level; of others only warnings are written."""
_bound: ContextVar[dict[str, str | int]] = ContextVar("bound")
_everywhere: dict[str, str | int] = {}


class LogForm(StrEnum):
    """How a record is written."""

    TEXT = "text"
    JSON = "json"


class LogSettings(BaseModel):
    """The level and the form of a process's log."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    level: Literal["debug", "info", "warning", "error"] = Field(default="info", description="lowest that is logged")
    form: LogForm = Field(default=LogForm.TEXT, description="lines to read, or one JSON object a line")
    traces: AnyHttpUrl | None = Field(
        default=None,
        description='where service and workers send spans by OTLP over HTTP, as "http://127.0.0.1:4318/v1/traces"',
    )


def write_logs(settings: LogSettings, handler: logging.Handler | None = None) -> None:
    """Write the records of this process to `handler`, by default to standard error; ends what a call before began."""
    root = logging.getLogger()
    for before in [each for each in root.handlers if isinstance(each.formatter, Text | Json)]:
        root.removeHandler(before)
        before.close()
    handler = handler or logging.StreamHandler()
    handler.setFormatter(Json() if settings.form is LogForm.JSON else Text())
    root.addHandler(handler)
    root.setLevel(logging.WARNING)
    for name in OURS:
        logging.getLogger(name).setLevel(settings.level.upper())


class BackgroundHandler(QueueHandler):
    """Passes records on to a thread that gives them to `handler`, so that a disk that hangs delays nobody who logs.

    Records beyond `WAITING` are dropped; the next one that fits says how many.
    """

    def __init__(self, handler: logging.Handler) -> None:
        super().__init__(queue.Queue(WAITING))
        self._handler = handler
        self._dropped = 0
        self._thread = Thread(target=self._write, name="log", daemon=True)
        self._thread.start()

    def prepare(self, record: logging.LogRecord) -> logging.LogRecord:
        """Format a record."""
        if self._dropped:
            record.msg = f"{record.msg} ({self._dropped} records before this one were dropped)"
        found: logging.LogRecord = super().prepare(record)
        return found

    def enqueue(self, record: logging.LogRecord) -> None:
        """Pass on a record, without a wait."""
        try:
            self.queue.put_nowait(record)
            self._dropped = 0
        except queue.Full:
            self._dropped += 1

    def close(self) -> None:
        """Write what waits, for a second at most."""
        with suppress(queue.Full):
            self.queue.put_nowait(None)
        self._thread.join(1.0)
        super().close()

    def _write(self) -> None:
        while (record := self.queue.get()) is not None:
            self._handler.handle(record)


class LogFile(RotatingFileHandler):
    """A log file of limited size. A record that cannot be written to it is one line of standard error, with the reason.

    On a full disk the standard library prints a traceback for each record instead.
    """

    def handleError(self, record: logging.LogRecord) -> None:
        """Write the record elsewhere; nothing is left to be done where that fails, too."""
        with suppress(OSError):
            sys.stderr.write(f"{self.format(record)} (not in the log: {sys.exc_info()[1]})\n")


@contextmanager
def belonging_to(**ids: str | int) -> Iterator[None]:
    """Records of this context, and of threads that copy it, have these ids, such as ``request`` or ``job``."""
    token = _bound.set({**_bound.get({}), **ids})
    try:
        yield
    finally:
        _bound.reset(token)


@contextmanager
def everything_belongs_to(**ids: str | int) -> Iterator[None]:
    """Records of every thread of this process have these ids: a drive process carries out one run at a time."""
    _everywhere.update(ids)
    try:
        yield
    finally:
        for name in ids:
            _everywhere.pop(name, None)


def _ids() -> dict[str, str | int]:
    return {**_everywhere, **_bound.get({})}


class Text(logging.Formatter):
    """A line with time in UTC, level, thread, ids and message."""

    def __init__(self) -> None:
        super().__init__("%(at)sZ %(levelname)s %(threadName)s: %(message)s%(ids)s")

    def format(self, record: logging.LogRecord) -> str:
        """The line, and below it the traceback where there is one."""
        ids = " ".join(f"{name}={value}" for name, value in _ids().items())
        record.at = f"{datetime.fromtimestamp(record.created, UTC):%Y-%m-%dT%H:%M:%S}"
        record.ids = f" [{ids}]" if ids else ""
        return super().format(record)


class Json(logging.Formatter):
    """One JSON object a line."""

    def format(self, record: logging.LogRecord) -> str:
        """The line; `error` has the traceback where there is one."""
        fields: dict[str, str | int] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "process": record.process or 0,
            "thread": record.threadName or "",
            "message": record.getMessage(),
            **_ids(),
        }
        if record.exc_info:
            fields["error"] = self.formatException(record.exc_info)
        return json.dumps(fields, ensure_ascii=False)
