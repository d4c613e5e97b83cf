"""How long the database may keep its caller waiting: limits for all calls, and a deadline for one piece of work.

Why the client keeps the time itself: docs/decisions/0013-no-call-of-the-database-waits-for-ever.md.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Annotated

from pydantic import ConfigDict
from pydantic.dataclasses import dataclass

from store.quantity import quantity

LONGEST = 3600.0
"""Seconds that one statement of an upgrade, a check or a backup may take."""

_ends: ContextVar[float | None] = ContextVar("ends", default=None)


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class TimeLimits:
    """Seconds after which a call of the database ends with a StoreError. They hold for the waveform files, too.

    Attributes:
        connect: to connect to each address of the server's name; psycopg waits 2 s at least.
        answer: for the answer to one statement, by the server's clock and by the client's.
        lock: for which a writer waits for another writer.
        idle: for which a server keeps a transaction open without a statement from its program.
        pool: for which a thread waits for a connection while other threads use all of them.
    """

    connect: Annotated[float, quantity("s", "to reach the server", gt=0, le=LONGEST)] = 5.0
    answer: Annotated[float, quantity("s", "of one statement", gt=0, le=LONGEST)] = 20.0
    lock: Annotated[float, quantity("s", "that a writer waits for another", gt=0, le=LONGEST)] = 10.0
    idle: Annotated[float, quantity("s", "of an open transaction without a statement", gt=0, le=LONGEST)] = 120.0
    pool: Annotated[float, quantity("s", "that a thread waits for a connection", gt=0, le=LONGEST)] = 10.0


DEFAULT_LIMITS = TimeLimits()


@contextmanager
def deadline(seconds: float) -> Iterator[None]:
    """Let every call of the database by this thread, or task, end within `seconds` s from now.

    An earlier deadline of the caller stays. A new connection may take 2 s all the same.
    """
    token = _ends.set(time.monotonic() + seconds_left(seconds))
    try:
        yield
    finally:
        _ends.reset(token)


def seconds_left(limit: float) -> float:
    """The smaller one of `limit` (s) and the time to the deadline, if there is a deadline; never below 0."""
    ends = _ends.get()
    return limit if ends is None else max(0.0, min(limit, ends - time.monotonic()))
