"""Connections to the database: its address, settings that keep data safe, and errors with advice."""

import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psycopg
from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError, SQLAlchemyError, StatementError

from store.errors import DamagedError, StoreError
from store.provenance import to_json

SQLITE = "sqlite"
PATIENCE = 10.0
"""Seconds that a writer waits for another writer before the database counts as locked."""

_FREE_SPACE = "free some space on the disk and try again"
_WAIT = "another program is writing: close it, or try again later"
_PERMIT = "let this user write to the file and its folder"
_DISK = "check whether the disk is full, read-only or disconnected, then try again"

# The lower byte of SQLite's result code says what happened, the higher ones where.
_SQLITE = {
    sqlite3.SQLITE_FULL: _FREE_SPACE,
    sqlite3.SQLITE_BUSY: _WAIT,
    sqlite3.SQLITE_LOCKED: _WAIT,
    sqlite3.SQLITE_READONLY: _PERMIT,
    sqlite3.SQLITE_PERM: _PERMIT,
    sqlite3.SQLITE_CANTOPEN: _PERMIT,
    sqlite3.SQLITE_IOERR: _DISK,
}
_POSTGRESQL = {"53100": _FREE_SPACE, "55P03": _WAIT, "40P01": _WAIT, "25006": _PERMIT, "42501": _PERMIT, "58030": _DISK}


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


def make_engine(address: URL) -> Engine:
    """An engine whose commits survive a power cut, and whose writers wait `PATIENCE` seconds for each other."""
    if address.drivername == SQLITE:
        engine = create_engine(address, json_serializer=to_json, connect_args={"timeout": PATIENCE})
        event.listen(engine, "connect", _prepare_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
        return engine
    settings = f"-c timezone=UTC -c lock_timeout={1000 * PATIENCE:.0f}"
    options = {"connect_timeout": 10, "options": settings}
    return create_engine(address, json_serializer=to_json, connect_args=options, pool_pre_ping=True)


@contextmanager
def explained(address: URL) -> Iterator[None]:
    """Turn an error of the database into an error of the store, in one line."""
    try:
        yield
    except SQLAlchemyError as error:
        cause = error.orig if isinstance(error, StatementError) and error.orig is not None else error
        if isinstance(cause, StoreError):
            raise StoreError(str(cause)) from error
        raise StoreError(f"{address.render_as_string(hide_password=True)}: {driver_message(cause)}") from error
    except UnicodeDecodeError as error:  # in the text of a damaged file, or in SQLite's message about it
        raise DamagedError(address.render_as_string(hide_password=True), "its structure is damaged") from error


def prepare_sqlite(connection: sqlite3.Connection) -> None:
    """Set a new connection so that readers and the writer do not block each other and a commit survives a power cut.

    This needs a write-ahead log and full synchronisation.
    """
    # SQLite does not wait for its lock here, as it does elsewhere: two that open a new file at once would collide.
    patience_ends = time.monotonic() + PATIENCE
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
    elif isinstance(error, psycopg.Error):
        advice = _POSTGRESQL.get(error.sqlstate or "")
    return f"{reason}; {advice}" if advice else reason


def _prepare_sqlite(connection: sqlite3.Connection, _record: Any) -> None:
    # Python's driver would begin transactions itself, too late and not for DDL: _begin_sqlite does it.
    connection.isolation_level = None
    prepare_sqlite(connection)
    connection.execute("PRAGMA foreign_keys = ON").close()


def _begin_sqlite(connection: Connection) -> None:
    # A writer takes the lock at once: a reader that becomes a writer could be refused without waiting.
    writing = connection.get_execution_options().get("writing", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writing else "BEGIN")
