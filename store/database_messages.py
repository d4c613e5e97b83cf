"""What to do where a database refuses: the disk is full, another program writes, the folder is read-only."""

from __future__ import annotations

import sqlite3

import psycopg

_FREE_SPACE = "free some space on the disk and do it again"
_WAIT = "another program is writing: close it, or do it again later"
_PERMIT = "let this user write to the file and its folder"
_DISK = "see whether the disk is full, read-only or gone, then do it again"

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
_POSTGRESQL = {
    "53100": _FREE_SPACE,
    "55P03": _WAIT,
    "40P01": _WAIT,
    "25006": _PERMIT,
    "42501": _PERMIT,
    "58030": _DISK,
}


def in_words(error: BaseException) -> str:
    """What a driver said, in one line, and what to do where that is known."""
    reason = (str(error).strip() or type(error).__name__).splitlines()[0]
    advice = None
    if isinstance(error, sqlite3.Error):
        advice = _SQLITE.get(getattr(error, "sqlite_errorcode", 0) & 0xFF)
    elif isinstance(error, psycopg.Error):
        advice = _POSTGRESQL.get(error.sqlstate or "")
    return f"{reason}; {advice}" if advice else reason
