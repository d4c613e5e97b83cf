"""Connections to a PostgreSQL server on which every wait ends in time, even if the server is silent.

The limits of the server and of TCP do not help where something between takes what is sent and answers nothing, such as
a proxy or a frozen server: the client has to look at the clock itself.
"""

import time
from collections.abc import Callable
from typing import Any

import psycopg
from psycopg.abc import RV, PQGen

from store.database.time_limits import TimeLimits, seconds_left

_GRACE = 1.0  # s that the server's own message about a limit may be late
_KEEPALIVE = {"keepalives": 1, "keepalives_idle": 10, "keepalives_interval": 3, "keepalives_count": 3}


class SilentServerError(psycopg.OperationalError):
    """The server has not answered in time; the connection is closed."""

    has_been_waited_for = True


class BoundedConnection(psycopg.Connection[Any]):
    """A connection whose calls end within `answer` s, and by the deadline of the caller where there is one."""

    answer: float

    def wait(self, gen: PQGen[RV], interval: float = 0.1, timeout: float | None = None) -> RV:
        """Wait for the server; SilentServerError where it does not answer in time."""
        limit = seconds_left(self.answer + _GRACE)
        limit = limit if timeout is None else min(limit, timeout)
        began = time.monotonic()
        try:
            return super().wait(gen, interval, limit)
        except psycopg.OperationalError as error:
            took = time.monotonic() - began
            if took < limit or self.closed:
                raise
            self.close()
            raise _silent(took) from error


def _silent(seconds: float) -> SilentServerError:
    return SilentServerError(
        f"the database has not answered for {seconds:.1f} s; look whether its server runs and is reached"
    )


def server_settings(limits: TimeLimits) -> dict[str, Any]:
    """Parameters of libpq: limits of the server and of TCP; times are UTC.

    A commit waits for the server's disk, whatever is usual there: what is stored is removed from the spool of its run.
    """
    milliseconds = {
        "lock_timeout": limits.lock,
        "statement_timeout": limits.answer,
        "idle_in_transaction_session_timeout": limits.idle,
    }
    options = " ".join(f"-c {name}={1000 * seconds:.0f}" for name, seconds in milliseconds.items())
    return {
        "connect_timeout": max(1, round(limits.connect)),
        "tcp_user_timeout": round(1000 * limits.connect),
        "options": f"-c timezone=UTC -c synchronous_commit=on {options}",
        **_KEEPALIVE,
    }


def connect_function(limits: TimeLimits) -> Callable[..., BoundedConnection]:
    """A listener for SQLAlchemy's event `do_connect`."""

    def connect(_dialect: Any, _record: Any, arguments: list[Any], settings: dict[str, Any]) -> BoundedConnection:
        within = max(1, round(seconds_left(limits.connect)))
        try:
            connection = BoundedConnection.connect(*arguments, **{**settings, "connect_timeout": within})
        except psycopg.errors.ConnectionTimeout as error:
            raise _silent(within) from error
        connection.answer = limits.answer
        return connection

    return connect
