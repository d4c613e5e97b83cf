"""SQLite with a write-ahead journal and full synchronisation, as the catalogue and the waveform files have it."""

from __future__ import annotations

import time
from sqlite3 import SQLITE_BUSY, Connection, OperationalError

# Seconds that a writer waits for another one before it says that the database is locked.
PATIENCE = 10.0


def prepare(connection: Connection) -> None:
    """Set a new connection: readers and the writer do not block each other, a commit survives a power cut."""
    # SQLite does not wait for its lock here, as it does elsewhere: two that open a new file at once would collide.
    patience_ends = time.monotonic() + PATIENCE
    while True:
        try:
            connection.execute("PRAGMA journal_mode = WAL").close()
        except OperationalError as error:
            if error.sqlite_errorcode != SQLITE_BUSY or time.monotonic() > patience_ends:
                raise
            time.sleep(0.01)
        else:
            break
    connection.execute("PRAGMA synchronous = FULL").close()
