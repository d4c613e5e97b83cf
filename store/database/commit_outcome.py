"""Commits whose connection is lost: a new connection asks whether the server stored the transaction.

PostgreSQL gives each transaction that writes a number, and can tell for recent numbers how the transaction ended. A
commit of SQLite either returns or fails: there is no network connection that could be lost.
"""

import time
from dataclasses import dataclass

from sqlalchemy import Connection, Engine, text
from sqlalchemy.exc import DBAPIError, SQLAlchemyError
from sqlalchemy.orm import Session

from store.database.time_limits import TimeLimits, deadline
from store.errors import ConnectionLostError, UnknownOutcomeError

_PAUSE = 0.02  # s between two questions
# Ends the session of the transaction, if it still waits for its client. The view has the number without its upper half.
_END = """
SELECT pg_terminate_backend(pid) FROM pg_stat_activity
WHERE pid = :process AND backend_xid::text::bigint = :number & 4294967295
"""


@dataclass(frozen=True)
class _Transaction:
    number: int
    process: int


def commit(session: Session, engine: Engine, limits: TimeLimits) -> None:
    """Commit the transaction of `session`; where the connection is lost meanwhile, find out whether it was stored.

    Raises:
        ConnectionLostError: nothing was stored.
        UnknownOutcomeError: the server could not be asked within `limits.answer`.
        SQLAlchemyError: the database refuses.
    """
    session.flush()
    transaction = _number(session) if session.in_transaction() else None
    try:
        session.commit()
    except DBAPIError as error:
        if transaction is None or not error.connection_invalidated:
            raise
        if not _is_stored(transaction, engine, limits):
            raise ConnectionLostError("the connection to the database was lost; nothing was stored") from error


def _number(session: Session) -> _Transaction | None:
    """The transaction of `session` on a server; None where it has not written."""
    if session.get_bind().dialect.name != "postgresql":
        return None
    number, process = session.execute(text("SELECT txid_current_if_assigned(), pg_backend_pid()")).one()
    return None if number is None else _Transaction(number, process)


def _is_stored(transaction: _Transaction, engine: Engine, limits: TimeLimits) -> bool:
    ends = time.monotonic() + limits.answer
    why: object = "its transaction does not end"
    with deadline(limits.answer):
        while time.monotonic() < ends:
            try:
                with engine.connect() as connection:
                    status = _status(connection, transaction)
            except SQLAlchemyError as error:
                why = error.__cause__ or error
            else:
                if status in ("committed", "aborted"):
                    return status == "committed"
            time.sleep(_PAUSE)
    raise UnknownOutcomeError(
        "the connection to the database was lost while changes were committed, and it cannot be asked "
        f"({str(why).splitlines()[0]}); look whether they are stored before you repeat them"
    )


def _status(connection: Connection, transaction: _Transaction) -> str:
    numbers = {"number": transaction.number, "process": transaction.process}
    status = connection.scalar(text("SELECT txid_status(:number)"), numbers)
    if status == "in progress":
        connection.execute(text(_END), numbers)
    return str(status)
