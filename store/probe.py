"""Whether the database answers, for a health route and for a page: known at any moment, without waiting for it."""

import threading
import time
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Self

from sqlalchemy import text

from store.catalogue import Catalogue
from store.errors import StoreError

PERIOD = 2.0  # s between two questions
LATE = 1.0  # s without an answer, after which the database counts as silent
_QUESTION = text("SELECT version_num FROM alembic_version")


@dataclass(frozen=True)
class DatabaseState:
    """The state of the database, as far as it is known.

    Attributes:
        answers: whether it does; None before the first answer.
        seconds: what the last answer took, or how long there has been none.
        why: the error where it does not answer.
    """

    answers: bool | None
    seconds: float
    why: str | None = None


class Probe(ABC):
    """Looks at something every `period` s in a thread of its own, called `name`, so that nobody waits for it.

    A subclass sets what `_look` needs before it calls `__init__` of this class, which starts the thread.
    """

    def __init__(self, name: str, period: float) -> None:
        self._period = period
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._thread.start()

    @abstractmethod
    def _look(self) -> None:
        """Look once, and keep what was seen."""

    def close(self) -> None:
        """Stop looking; does not wait for what does not answer."""
        self._ended.set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def _work(self) -> None:
        while not self._ended.is_set():
            self._look()
            self._ended.wait(self._period)


class DatabaseProbe(Probe):
    """Asks a database; it reads only.

    A silent database makes `state` say so after `LATE` s, and the thread ends with the limits of the catalogue.
    """

    def __init__(self, catalogue: Catalogue, period: float = PERIOD) -> None:
        self._catalogue = catalogue
        self._last = DatabaseState(None, 0.0)
        self._asked: float | None = None  # monotonic clock, of the question that has no answer yet
        super().__init__("database probe", period)

    @property
    def state(self) -> DatabaseState:
        """The state that is known now; never waits."""
        asked, last = self._asked, self._last
        silent = 0.0 if asked is None else time.monotonic() - asked
        if silent <= LATE:
            return last
        return DatabaseState(False, silent, last.why or f"it has not answered for {silent:.1f} s")

    def _look(self) -> None:
        began = self._asked = time.monotonic()
        try:
            with self._catalogue.reading() as session:
                session.execute(_QUESTION)
        except StoreError as error:
            self._last = DatabaseState(False, time.monotonic() - began, str(error))
        else:
            self._last = DatabaseState(True, time.monotonic() - began)
        self._asked = None
