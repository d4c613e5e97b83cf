"""Connections to the database: its address, settings that keep data safe, and errors with advice."""

import math
import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, OperationalError, SQLAlchemyError, StatementError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError

from store.database.time_limits import LONGEST, TimeLimits, seconds_left
from store.errors import ConnectionLostError, DamagedError, SilentError, StoreError
from store.extras import explained_imports
from store.provenance import to_json
from store.text import contains_half

SQLITE = "sqlite"

_STEPS = 20_000  # of SQLite's machine, some milliseconds, after which it looks at the clock
_FREE_SPACE = "free some space on the disk and try again"
_WAIT = "another program is writing: close it, or try again later"
_PERMIT = "let this user write to the file and its folder"
_DISK = "check whether the disk is full, read-only or disconnected, then try again"
_BUSY = "try again later; long requests of others may hold them"
_NO_UNICODE = "text contains half of a surrogate pair, such as a byte that is not UTF-8; write it in UTF-8"
_LONGEST_SHOWN = 60  # characters of a wrong text
_LATE = "it took longer than it may: ask for less at a time, or raise the limit (database_limits)"

# The lower byte of SQLite's result code says what happened, the higher ones where.
_SQLITE = {
    sqlite3.SQLITE_FULL: _FREE_SPACE,
    sqlite3.SQLITE_BUSY: _WAIT,
    sqlite3.SQLITE_LOCKED: _WAIT,
    sqlite3.SQLITE_READONLY: _PERMIT,
    sqlite3.SQLITE_PERM: _PERMIT,
    sqlite3.SQLITE_CANTOPEN: _PERMIT,
    sqlite3.SQLITE_IOERR: _DISK,
    sqlite3.SQLITE_INTERRUPT: _LATE,
}
_POSTGRESQL = {
    "53100": _FREE_SPACE, "55P03": _WAIT, "40P01": _WAIT, "25006": _PERMIT, "42501": _PERMIT, "58030": _DISK,
    "57014": _LATE, "25P03": _LATE,
}  # fmt: skip


def address_of(url: str) -> URL:
    """The address of a database; StoreError if it is invalid, in memory or of another kind than the two."""
    try:
        address = make_url(url)
    except (ArgumentError, ValueError) as error:
        raise StoreError(f"{url!r} is not the address of a database; write sqlite:///lab.db") from error
    if address.drivername in ("postgresql", "postgres"):
        address = address.set(drivername="postgresql+psycopg")
    if address.drivername not in (SQLITE, "postgresql+psycopg"):
        raise StoreError(f"database {address.drivername!r} is not supported; use sqlite:/// or postgresql://")
    if address.drivername == SQLITE and address.database in (None, "", ":memory:"):
        raise StoreError("a database in memory loses the results; name a file, such as sqlite:///lab.db")
    return address


def is_made(url: str) -> bool:
    """Whether the database exists; a database on a server is assumed to exist. StoreError as for `address_of`."""
    address = address_of(url)
    return address.drivername != SQLITE or Path(str(address.database)).is_file()


def waveform_folder_of(address: URL) -> Path:
    """The default folder of waveforms: beside an SQLite file.

    Raises StoreError if the database is on a server, or the folder of the SQLite file is missing.
    """
    if address.drivername != SQLITE:
        raise StoreError("with PostgreSQL, set the folder of waveforms (waveform_folder)")
    database = Path(str(address.database))
    if not database.parent.is_dir():
        raise StoreError(f"there is no folder {database.parent} for the database; make it first")
    return database.with_name(database.stem + "-waveforms")


def make_engine(address: URL, limits: TimeLimits) -> Engine:
    """An engine whose commits survive a power cut, and whose calls end within `limits`."""
    if address.drivername == SQLITE:
        engine = create_engine(
            address, json_serializer=_json_text, connect_args={"timeout": limits.lock}, pool_timeout=limits.pool
        )
        event.listen(engine, "connect", lambda connection, record: _prepare_sqlite(connection, record, limits))
        event.listen(engine, "begin", lambda connection: _begin_sqlite(connection, limits))
        event.listen(engine, "before_cursor_execute", lambda connection, *_: _start_clock(connection, limits))
        return engine
    with explained_imports():
        from store.database.server_connection import connect_function, server_settings
    engine = create_engine(
        address,
        json_serializer=_json_text,
        connect_args=server_settings(limits),
        pool_pre_ping=True,
        pool_timeout=limits.pool,
    )
    event.listen(engine, "do_connect", connect_function(limits))
    event.listen(engine, "begin", lambda connection: setattr(_bounded(connection), "answer", limits.answer))
    return engine


def allow_long_work(connection: Connection) -> None:
    """Let the statements of this transaction take up to `LONGEST` s each, and as long between them."""
    if connection.dialect.name == SQLITE:
        connection.info["answer"] = LONGEST
    else:
        names = ("statement_timeout", "idle_in_transaction_session_timeout")
        connection.exec_driver_sql(
            "SELECT " + ", ".join(f"set_config('{name}', '{LONGEST:.0f}s', true)" for name in names)
        )
        _bounded(connection).answer = LONGEST


class AdvisoryLock(IntEnum):
    """Locks of a PostgreSQL server; numbers that no other program on it is likely to use."""

    MIGRATION = 7_341_902_418
    JOB_QUEUE = 7_341_902_419


def lock_until_end(connection: Connection, lock: AdvisoryLock) -> None:
    """Wait until nobody else holds `lock`, and hold it until this transaction ends; SQLite has one writer at a time."""
    if connection.dialect.name != SQLITE:
        connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({lock.value})")


def _bounded(connection: Connection) -> Any:
    """The `BoundedConnection` below a connection to a server."""
    return connection.connection.driver_connection


@contextmanager
def explained(address: URL) -> Iterator[None]:
    """Turn an error of the database into an error of the store, in one line."""
    try:
        yield
    except PoolTimeoutError as error:
        raise StoreError(f"{_shown(address)}: all connections are in use; {_BUSY}") from error
    except SQLAlchemyError as error:
        cause = error.orig if isinstance(error, StatementError) and error.orig is not None else error
        if isinstance(cause, StoreError):
            raise StoreError(str(cause)) from error
        lost = isinstance(error, DBAPIError) and error.connection_invalidated
        silent = isinstance(error, OperationalError) and getattr(cause, "sqlstate", "") is None
        kind = SilentError if silent else StoreError
        if lost and not getattr(cause, "has_been_waited_for", False):
            kind = ConnectionLostError
        raise kind(f"{_shown(address)}: {driver_message(cause)}") from error
    except UnicodeDecodeError as error:  # in the text of a damaged file, or in SQLite's message about it
        raise DamagedError(_shown(address), "its structure is damaged") from error
    except UnicodeEncodeError as error:  # in a value that was to be stored or compared
        raise StoreError(f"{str(error.object)[:_LONGEST_SHOWN]!r}: {_NO_UNICODE}") from error


def _json_text(document: Any) -> str:
    """JSON as it is stored; StoreError where it has none, or has half of a surrogate pair."""
    text = to_json(document)
    if "\\ud" in text and contains_half(document):
        raise StoreError(_NO_UNICODE)
    return text


def _shown(address: URL) -> str:
    return address.render_as_string(hide_password=True)


def prepare_sqlite(connection: sqlite3.Connection, patience: float) -> None:
    """Set a new connection so that readers and the writer do not block each other and a commit survives a power cut.

    This needs a write-ahead log and full synchronisation. Waits up to `patience` s for another program.
    """
    # SQLite does not wait for its lock here, as it does elsewhere: two that open a new file at once would collide.
    patience_ends = time.monotonic() + seconds_left(patience)
    while True:
        try:
            connection.execute("PRAGMA journal_mode = WAL").close()
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode != sqlite3.SQLITE_BUSY or time.monotonic() > patience_ends:
                raise
            time.sleep(0.01)
        else:
            break
    connection.execute("PRAGMA synchronous = FULL").close()


def driver_message(error: BaseException) -> str:
    """The first line of a driver's message, and advice where there is some."""
    reason = (str(error).strip() or type(error).__name__).splitlines()[0]
    advice = None
    if isinstance(error, sqlite3.Error):
        advice = _SQLITE.get(getattr(error, "sqlite_errorcode", 0) & 0xFF)
    elif (state := getattr(error, "sqlstate", None)) is not None:  # of psycopg
        advice = _POSTGRESQL.get(state)
    return f"{reason}; {advice}" if advice else reason


def _prepare_sqlite(connection: sqlite3.Connection, record: Any, limits: TimeLimits) -> None:
    # Python's driver would begin transactions itself, too late and not for DDL: _begin_sqlite does it.
    connection.isolation_level = None
    prepare_sqlite(connection, limits.lock)
    connection.execute("PRAGMA foreign_keys = ON").close()
    info = record.info
    info["patience"], info["ends"] = limits.lock, math.inf
    connection.set_progress_handler(lambda: time.monotonic() > info["ends"], _STEPS)


def _begin_sqlite(connection: Connection, limits: TimeLimits) -> None:
    connection.info["answer"] = limits.answer
    patience = seconds_left(limits.lock)
    if patience != connection.info["patience"]:
        connection.exec_driver_sql(f"PRAGMA busy_timeout = {1000 * patience:.0f}")
        connection.info["patience"] = patience
    # A writer takes the lock at once: a reader that becomes a writer could be refused without waiting.
    writing = connection.get_execution_options().get("writing", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writing else "BEGIN")


def _start_clock(connection: Connection, limits: TimeLimits) -> None:
    info = connection.info
    info["ends"] = time.monotonic() + seconds_left(info.get("answer", limits.answer))
