"""Errors of the store; each message names the fault, its place and a remedy."""


class StoreError(Exception):
    """The store cannot do this; nothing was stored."""


class NotFoundError(StoreError):
    """There is no such run, record or result."""


class LeftOutError(NotFoundError):
    """A computation was made and has none of these results; `reason` is a phrase."""

    def __init__(self, what: str, reason: str) -> None:
        super().__init__(f"{what}: {reason}")
        self.reason = reason


class SilentError(StoreError):
    """The database has not answered in time, or cannot be reached."""


class ConnectionLostError(StoreError):
    """The connection to the database was lost, and nothing of the transaction was stored: it may be tried again."""


class UnknownOutcomeError(StoreError):
    """The connection was lost during the commit: it is not known whether the transaction was stored."""


class ContradictionError(StoreError):
    """What is to be stored contradicts what is stored: it would be refused at each attempt."""


class WrongRigError(StoreError):
    """The run belongs to another rig."""


class DamagedError(StoreError):
    """Stored data are damaged: a checksum differs, or a record is incomplete."""

    def __init__(self, where: str, what: str) -> None:
        super().__init__(f"{where}: {what}; {RESTORE}")
        self.where = where
        self.what = what


RESTORE = "restore it from a backup"
