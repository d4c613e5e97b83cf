"""One process at a time carries out a run: a lock that the operating system takes back when its process dies.

The lock is that of an empty SQLite file beside the run's waveforms, which exists wherever SQLite does and cannot be
left behind held: after kill -9 or a power cut it is free. Whoever writes a run writes to that folder.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager

from store.catalogue import Catalogue
from store.errors import StoreError
from store.refusals import in_words
from store.runs import Run, list_run_events

SUFFIX = ".lock"


class RunBusyError(StoreError):
    """A living process carries out the run."""


@contextmanager
def holding(catalogue: Catalogue, run: Run) -> Iterator[None]:
    """Be the one process that carries out `run` while the context lasts; look at its state inside, not before.

    Raises:
        RunBusyError: another living process is; it is named.
        StoreError: the folder of waveforms cannot be written.
    """
    path = catalogue.waveforms.folder / (run.waveform_file + SUFFIX)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        connection = sqlite3.connect(path, timeout=0.0, isolation_level=None, check_same_thread=False)
    except (OSError, sqlite3.Error) as error:
        raise StoreError(f"{path} cannot be made: {error}") from error
    with closing(connection):
        try:
            connection.execute("BEGIN EXCLUSIVE")
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode != sqlite3.SQLITE_BUSY:
                raise StoreError(f"{path} cannot be locked: {in_words(error)}") from error
            raise RunBusyError(
                f"run {run.id} is being carried out by {_holder(catalogue, run)}; stop it there, or wait until it ends"
            ) from error
        yield


def discard_lock(catalogue: Catalogue, run: Run) -> None:
    """Remove the file of a run that is finished, which nobody needs to lock any more."""
    (catalogue.waveforms.folder / (run.waveform_file + SUFFIX)).unlink(missing_ok=True)


def _holder(catalogue: Catalogue, run: Run) -> str:
    with catalogue.reading() as session:
        named = [event.who for event in list_run_events(session, run.id) if event.who]
    return named[-1] if named else "another process"
