"""Errors of the store: the message says what was wrong, where, and what to do."""


class StoreError(Exception):
    """The store cannot do this; nothing was stored."""


class NotFoundError(StoreError):
    """There is no such run, record or result."""


class DamagedError(StoreError):
    """Stored bytes are not what was written: a checksum differs or a record is cut short."""
