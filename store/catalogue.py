"""The catalogue: one SQL database, SQLite or PostgreSQL, with its folder of waveforms.

    with Catalogue.open("sqlite:///lab.db") as catalogue, catalogue.writing() as session:
        run = start_run(session, kind="hammer", title="beam 3, 23 C", article="beam 3", setup={})

Functions of `store.runs`, `store.blows`, `store.modes`, ... take the session; a transaction is stored as a
whole or not at all.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

from sqlalchemy import Engine
from sqlalchemy.orm import Session

from store.database import address_of, explained, make_engine, waveform_folder_of
from store.errors import StoreError
from store.migrate import upgrade
from store.waveforms import WaveformFolder


class Catalogue:
    """An open database and its waveforms; `Catalogue.open` gives one."""

    def __init__(self, engine: Engine, waveforms: WaveformFolder) -> None:
        self._engine = engine
        self._writer = engine.execution_options(writing=True)
        is_postgresql = engine.dialect.name == "postgresql"
        self._reader = engine.execution_options(isolation_level="REPEATABLE READ") if is_postgresql else engine
        self.waveforms = waveforms

    @classmethod
    def open(cls, url: str, waveform_folder: Path | None = None) -> Self:
        """Open a database; an empty one gets its tables, an older one is updated.

        Args:
            url: ``sqlite:///path/to/file.db`` or ``postgresql://user@host/database``.
            waveform_folder: folder of waveforms; beside an SQLite file by default, required for PostgreSQL.

        Raises:
            StoreError: the address is not valid, the database cannot be reached, or its schema is not known.
        """
        address = address_of(url)
        waveforms = WaveformFolder(waveform_folder or waveform_folder_of(address))
        engine = make_engine(address)
        try:
            with explained(address), engine.execution_options(writing=True).begin() as connection:
                upgrade(connection)
        except StoreError:
            engine.dispose()
            raise
        return cls(engine, waveforms)

    @property
    def address(self) -> str:
        """The database's address without its password."""
        return self._engine.url.render_as_string(hide_password=True)

    @property
    def url(self) -> str:
        """The database's address with its password, to open the catalogue in another process."""
        return self._engine.url.render_as_string(hide_password=False)

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """A transaction, committed at the end of the block, undone on any error; StoreError if the database refuses."""
        with explained(self._engine.url), Session(self._writer, expire_on_commit=False) as session, session.begin():
            yield session

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """A transaction that reads one consistent state and does not wait for writers; StoreError if that fails."""
        with explained(self._engine.url), Session(self._reader, autoflush=False) as session:
            yield session
            session.rollback()

    def close(self) -> None:
        """Close the connections and the waveform files."""
        self.waveforms.close()
        self._engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()
