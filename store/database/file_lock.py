"""A lock between processes, which the operating system releases when the process that holds it dies.

It is that of an empty SQLite file: free after kill -9 or a power cut, and the same on every system.
"""

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from store.errors import StoreError


class LockHeldError(StoreError):
    """Another living process holds the lock, or this one does already."""


@contextmanager
def exclusive_lock(path: Path) -> Iterator[None]:
    """Hold the lock of the file `path`, which is created if it is missing, while the context lasts.

    Raises LockHeldError if another process holds it, StoreError if the file cannot be made or locked.
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
                raise StoreError(f"{path} cannot be locked: {error}") from error
            raise LockHeldError(f"{path} is held by another process") from error
        yield
