"""The catalogue: one SQL database, SQLite or PostgreSQL, and the folder of waveforms beside it.

    with Catalogue.open("sqlite:///lab.db") as catalogue, catalogue.writing() as session:
        run = start_run(session, kind="hammer", title="beam 3, 23 C", article="beam 3", setup={})

Functions of `store.runs`, `store.blows`, `store.modes`, ... take the session; a transaction is stored as a
whole or not at all.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from sqlite3 import SQLITE_BUSY, OperationalError
from sqlite3 import Connection as SqliteConnection
from types import TracebackType
from typing import Any, Self

from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError, SQLAlchemyError, StatementError
from sqlalchemy.orm import Session

from store.errors import StoreError
from store.migrate import upgrade
from store.provenance import to_json
from store.waveforms import WaveformFolder

# Seconds that a writer waits for another one before it says that the database is locked.
SQLITE_PATIENCE = 10.0


class Catalogue:
    """An open database and its waveforms; make one with `Catalogue.open`."""

    def __init__(self, engine: Engine, waveforms: WaveformFolder) -> None:
        self._engine = engine
        self._writer = engine.execution_options(writing=True)
        is_postgresql = engine.dialect.name == "postgresql"
        self._reader = engine.execution_options(isolation_level="REPEATABLE READ") if is_postgresql else engine
        self.waveforms = waveforms

    @classmethod
    def open(cls, url: str, waveform_folder: Path | None = None) -> Self:
        """Open a database; an empty one gets its tables, an older one is brought up to date.

        Args:
            url: ``sqlite:///path/to/file.db`` or ``postgresql://user@host/database``.
            waveform_folder: where waveforms go; beside an SQLite file by default, required for PostgreSQL.

        Raises:
            StoreError: the address is not understood, the database cannot be reached, or its schema is not known.
        """
        address = _address(url)
        waveforms = WaveformFolder(waveform_folder or _folder_beside(address))
        engine = _engine(address)
        try:
            with _explained(address), engine.execution_options(writing=True).begin() as connection:
                upgrade(connection)
        except StoreError:
            engine.dispose()
            raise
        return cls(engine, waveforms)

    @property
    def address(self) -> str:
        """The database's address without its password."""
        return self._engine.url.render_as_string(hide_password=True)

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """A transaction that is committed when the block ends, and undone as a whole on any error.

        Raises:
            StoreError: the database refuses (locked, full, unreachable, a rule of the schema).
        """
        with _explained(self._engine.url), Session(self._writer, expire_on_commit=False) as session, session.begin():
            yield session

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """A transaction that only reads; it sees one consistent state and does not wait for writers.

        Raises:
            StoreError: the database cannot be read.
        """
        with _explained(self._engine.url), Session(self._reader, autoflush=False) as session:
            yield session
            session.rollback()

    def close(self) -> None:
        """Close the connections and the waveform files."""
        self.waveforms.close()
        self._engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _address(url: str) -> URL:
    try:
        address = make_url(url)
    except (ArgumentError, ValueError) as error:
        raise StoreError(f"{url!r} is not the address of a database; write sqlite:///lab.db") from error
    if address.drivername in ("postgresql", "postgres"):
        address = address.set(drivername="postgresql+psycopg")
    if address.drivername not in ("sqlite", "postgresql+psycopg"):
        raise StoreError(f"database {address.drivername!r} is not supported; use sqlite:/// or postgresql://")
    if address.drivername == "sqlite" and address.database in (None, "", ":memory:"):
        raise StoreError("a database in memory loses the results; name a file, such as sqlite:///lab.db")
    return address


def _folder_beside(address: URL) -> Path:
    if address.drivername != "sqlite":
        raise StoreError("with PostgreSQL, say where waveforms go (waveform_folder)")
    database = Path(str(address.database))
    if not database.parent.is_dir():
        raise StoreError(f"there is no folder {database.parent} for the database; make it first")
    return database.with_name(database.stem + "-waveforms")


def _engine(address: URL) -> Engine:
    if address.drivername == "sqlite":
        engine = create_engine(address, json_serializer=to_json, connect_args={"timeout": SQLITE_PATIENCE})
        event.listen(engine, "connect", _prepare_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
        return engine
    options = {"connect_timeout": 10, "options": "-c timezone=UTC"}
    return create_engine(address, json_serializer=to_json, connect_args=options, pool_pre_ping=True)


def _prepare_sqlite(connection: SqliteConnection, _record: Any) -> None:
    # Python's driver would begin transactions by itself, too late and not for DDL: _begin_sqlite does it.
    connection.isolation_level = None
    _write_ahead(connection)
    for pragma in ("synchronous = FULL", "foreign_keys = ON"):
        connection.execute(f"PRAGMA {pragma}").close()


def _write_ahead(connection: SqliteConnection) -> None:
    # SQLite does not wait for its lock here, as it does elsewhere: two that open a new file at once would collide.
    patience_ends = time.monotonic() + SQLITE_PATIENCE
    while True:
        try:
            connection.execute("PRAGMA journal_mode = WAL").close()
        except OperationalError as error:
            if error.sqlite_errorcode != SQLITE_BUSY or time.monotonic() > patience_ends:
                raise
            time.sleep(0.01)
        else:
            return


def _begin_sqlite(connection: Connection) -> None:
    # A writer takes the lock at once: a reader that turns writer half-way could be refused without waiting.
    writing = connection.get_execution_options().get("writing", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writing else "BEGIN")


@contextmanager
def _explained(address: URL) -> Iterator[None]:
    """Turn what the database says into an error of the store, in one line."""
    try:
        yield
    except SQLAlchemyError as error:
        cause = error.orig if isinstance(error, StatementError) else error
        if isinstance(cause, StoreError):
            raise StoreError(str(cause)) from error
        reason = (str(cause).strip() or type(error).__name__).splitlines()[0]
        raise StoreError(f"{address.render_as_string(hide_password=True)}: {reason}") from error
