"""A lock between processes that the operating system takes back when the process that holds it dies.

It is that of an empty SQLite file, which exists wherever SQLite does and cannot be left behind held: after kill -9 or a
power cut it is free.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from store.database_messages import in_words
from store.errors import StoreError


class HeldElsewhereError(StoreError):
    """Another living process holds the lock, or this one does already."""


@contextmanager
def held_alone(path: Path) -> Iterator[None]:
    """Hold the lock of the file `path`, which is made where it is not there, while the context lasts.

    Raises:
        HeldElsewhereError: somebody else holds it.
        StoreError: the file cannot be made or locked.
    """
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
            raise HeldElsewhereError(f"{path} is held by another process") from error
        yield
