"""Errors of the store: the message says what was wrong, where, and what to do."""

from __future__ import annotations


class StoreError(Exception):
    """The store cannot do this; nothing was stored."""


class NotFoundError(StoreError):
    """There is no such run, record or result."""


class DamagedError(StoreError):
    """Stored bytes are not what was written: a checksum differs or a record is cut short."""

    def __init__(self, where: str, what: str) -> None:
        super().__init__(f"{where}: {what}; {RESTORE}")
        self.where = where
        self.what = what


RESTORE = "restore it from a backup"
