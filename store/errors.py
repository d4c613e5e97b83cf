"""Errors of the store; each message names the fault, its place and a remedy."""


class StoreError(Exception):
    """The store cannot do this; nothing was stored."""


class NotFoundError(StoreError):
    """There is no such run, record or result."""


class DamagedError(StoreError):
    """Stored data are damaged: a checksum differs, or a record is incomplete."""

    def __init__(self, where: str, what: str) -> None:
        super().__init__(f"{where}: {what}; {RESTORE}")
        self.where = where
        self.what = what


RESTORE = "restore it from a backup"
