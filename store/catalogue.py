"""The catalogue: one SQL database, SQLite or PostgreSQL, with its folder of waveforms.

    with Catalogue.open("sqlite:///lab.db") as catalogue, catalogue.writing() as session:
        run = start_run(session, kind="sequence", title="beam 3, 23 C", article="beam 3", setup={})

Functions of `store.measurements`, `store.results` and `store.service` take the session; a transaction is stored as a
whole or not at all.
"""

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Concatenate, ParamSpec, Self, TypeVar

from sqlalchemy import Engine, event
from sqlalchemy.orm import Session

from store.database.commit_outcome import commit
from store.database.connection import address_of, allow_long_work, explained, make_engine, waveform_folder_of
from store.database.time_limits import DEFAULT_LIMITS, TimeLimits
from store.errors import ConnectionLostError, StoreError
from store.migrate import DEFAULT_RIG, upgrade
from store.waveforms.folder import WaveformFolder

ResultT = TypeVar("ResultT")
Parameters = ParamSpec("Parameters")
CatalogueParts = tuple[str, Path, TimeLimits]
"""Address of a database, its folder of waveforms, and how long a call may take."""
log = logging.getLogger(__name__)


class Catalogue:
    """An open database and its waveforms; `Catalogue.open` gives one."""

    def __init__(self, engine: Engine, waveforms: WaveformFolder, limits: TimeLimits) -> None:
        self._engine = engine
        self._limits = limits
        self._writer = engine.execution_options(writing=True)
        is_postgresql = engine.dialect.name == "postgresql"
        self._reader = engine.execution_options(isolation_level="REPEATABLE READ") if is_postgresql else engine
        self.waveforms = waveforms

    @classmethod
    def open(
        cls, url: str, waveform_folder: Path | None = None, limits: TimeLimits = DEFAULT_LIMITS, rig: str = DEFAULT_RIG
    ) -> Self:
        """Open a database; an empty one gets its tables, an older one is updated.

        Args:
            url: ``sqlite:///path/to/file.db`` or ``postgresql://user@host/database``.
            waveform_folder: folder of waveforms; beside an SQLite file by default, required for PostgreSQL.
            limits: how long a call may take.
            rig: to which the runs of an older database belong, from before rigs had names.

        Raises:
            StoreError: the address is not valid, the database cannot be reached, or its schema is not known.
        """
        address = address_of(url)
        waveforms = WaveformFolder(waveform_folder or waveform_folder_of(address), limits)
        engine = make_engine(address, limits)
        try:
            with explained(address), engine.execution_options(writing=True).begin() as connection:
                allow_long_work(connection)
                upgrade(connection, rig)
        except StoreError:
            engine.dispose()
            raise
        return cls(engine, waveforms, limits)

    @property
    def address(self) -> str:
        """The database's address without its password."""
        return self._engine.url.render_as_string(hide_password=True)

    @property
    def place(self) -> CatalogueParts:
        """Arguments of `open` for another process, with the password of the database."""
        return self._engine.url.render_as_string(hide_password=False), self.waveforms.folder, self._limits

    @property
    def limits(self) -> TimeLimits:
        """Time limits of calls."""
        return self._limits

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """A transaction, committed at the end of the block, undone on any error.

        Raises:
            ConnectionLostError: the connection was lost; nothing was stored.
            UnknownOutcomeError: it was lost during the commit, and the database cannot be asked for its outcome.
            StoreError: the database refuses, or does not answer in time; nothing was stored.
        """
        with explained(self._engine.url), Session(self._writer, expire_on_commit=False) as session:
            yield session
            commit(session, self._engine, self._limits)

    def write(self, work: Callable[[Session], ResultT]) -> ResultT:
        """Carry out `work` in a transaction, and once more where the connection was lost and nothing was stored.

        `work` may therefore be called twice; what it does beside the database has to bear that. Errors as for
        `writing`.
        """
        try:
            with self.writing() as session:
                return work(session)
        except ConnectionLostError as error:
            log.warning("a transaction is tried once more: %s", error)
        with self.writing() as session:
            return work(session)

    @contextmanager
    def reading(self, *, long: bool = False) -> Iterator[Session]:
        """A transaction that reads one consistent state and does not wait for writers; StoreError if that fails.

        A statement of a `long` one may take an hour.
        """
        with explained(self._engine.url), Session(self._reader, autoflush=False) as session:
            if long:
                allow_long_work(session.connection())
            yield session
            session.rollback()

    def read(
        self,
        get: Callable[Concatenate[Session, Parameters], ResultT],
        *args: Parameters.args,
        **named: Parameters.kwargs,
    ) -> ResultT:
        """The result of `get`, called in a transaction of its own with its session and the other arguments."""
        with self.reading() as session:
            return get(session, *args, **named)

    def close(self) -> None:
        """Close the connections and the waveform files; a call of another thread closes its connection as it ends."""
        self.waveforms.close()
        event.listen(self._engine, "checkin", lambda _connection, record: record.invalidate())
        self._engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()
