"""Connections to the database: where it is, how it is set for safety, and what its errors mean."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from sqlite3 import Connection as SqliteConnection
from typing import Any

from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError, SQLAlchemyError, StatementError

from store import sqlite_wal
from store.database_messages import in_words
from store.errors import DamagedError, StoreError
from store.provenance import to_json

SQLITE = "sqlite"


def address_of(url: str) -> URL:
    """The address of a database that the store supports.

    Raises:
        StoreError: it is no address, of another kind of database, or of one in memory.
    """
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
    """Whether there is a database that can be opened without making it; one on a server is taken to be there.

    Raises:
        StoreError: as for `address_of`.
    """
    address = address_of(url)
    return address.drivername != SQLITE or Path(str(address.database)).is_file()


def waveform_folder_of(address: URL) -> Path:
    """Where waveforms go if nobody says: beside an SQLite file.

    Raises:
        StoreError: the database is on a server, or the SQLite file's folder is not there.
    """
    if address.drivername != SQLITE:
        raise StoreError("with PostgreSQL, say where waveforms go (waveform_folder)")
    database = Path(str(address.database))
    if not database.parent.is_dir():
        raise StoreError(f"there is no folder {database.parent} for the database; make it first")
    return database.with_name(database.stem + "-waveforms")


def make_engine(address: URL) -> Engine:
    """An engine whose commits survive a power cut, and whose writers wait `PATIENCE` seconds for each other."""
    patience = sqlite_wal.PATIENCE
    if address.drivername == SQLITE:
        engine = create_engine(address, json_serializer=to_json, connect_args={"timeout": patience})
        event.listen(engine, "connect", _prepare_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
        return engine
    settings = f"-c timezone=UTC -c lock_timeout={1000 * patience:.0f}"
    options = {"connect_timeout": 10, "options": settings}
    return create_engine(address, json_serializer=to_json, connect_args=options, pool_pre_ping=True)


@contextmanager
def explained(address: URL) -> Iterator[None]:
    """Turn what the database says into an error of the store, in one line."""
    try:
        yield
    except SQLAlchemyError as error:
        cause = error.orig if isinstance(error, StatementError) and error.orig is not None else error
        if isinstance(cause, StoreError):
            raise StoreError(str(cause)) from error
        raise StoreError(f"{address.render_as_string(hide_password=True)}: {in_words(cause)}") from error
    except UnicodeDecodeError as error:  # of a damaged file's text, or of what SQLite says about it
        raise DamagedError(address.render_as_string(hide_password=True), "its structure is damaged") from error


def _prepare_sqlite(connection: SqliteConnection, _record: Any) -> None:
    # Python's driver would begin transactions by itself, too late and not for DDL: _begin_sqlite does it.
    connection.isolation_level = None
    sqlite_wal.prepare(connection)
    connection.execute("PRAGMA foreign_keys = ON").close()


def _begin_sqlite(connection: Connection) -> None:
    # A writer takes the lock at once: a reader that turns writer half-way could be refused without waiting.
    writing = connection.get_execution_options().get("writing", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writing else "BEGIN")
