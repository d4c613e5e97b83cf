"""The audit log as the service keeps it: what moves the machine before it does, what came of it, and what was refused.

Refused deeds cannot fill the disk: whoever has no valid key is told so and not noted, and of one caller so many are
noted in an hour.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy.orm import Session

from store.audit import add_audit_entry
from store.catalogue import Catalogue
from store.errors import StoreError

BEGUN = "begun"
NOTED = 60
"""Refused deeds of one caller that are noted in an hour."""
HOUR = 3600.0  # s
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Deed:
    """Something that somebody asks for.

    Attributes:
        who: the caller.
        action: such as "start run".
        target: what it is done to, such as "run 7".
        moves: whether it moves the machine, and is noted before it is done, too.
        details: what else was given.
    """

    who: str
    action: str
    target: str
    moves: bool = False
    details: dict[str, Any] = field(default_factory=dict)

    def begin(self, session: Session) -> int | None:
        """Note that it is about to be done, where it moves the machine; the number of that entry, for its end."""
        return self._add(session, BEGUN, self.details) if self.moves else None

    def end(self, session: Session, outcome: str, begun: int | None) -> None:
        """Note what came of it."""
        self._add(session, outcome, self.details if begun is None else {**self.details, BEGUN: begun})

    def refuse(self, session: Session, why: str) -> None:
        """Note that it was refused, and not begun."""
        self._add(session, f"refused: {why}", {})

    def _add(self, session: Session, outcome: str, details: dict[str, Any]) -> int:
        return add_audit_entry(
            session, who=self.who, action=self.action, target=self.target, outcome=outcome, details=details
        )


@dataclass
class _Hour:
    ends: float
    noted: int = 0


class Refusals:
    """Notes deeds that were refused for want of scope or lease, `NOTED` an hour of each caller. Any thread may call it.

    Whoever may act can write the log anyway; a key that only reads cannot fill the disk with what it may not do.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._hours = dict[str, _Hour]()  # as many as there are keys

    def note(self, catalogue: Catalogue, deed: Deed, why: str) -> None:
        """Note that `deed` was refused. Whoever is refused is told so whether or not it can be noted."""
        number = self._number(deed.who)
        if number > NOTED:
            return
        last = "; no more is noted of them within the hour" if number == NOTED else ""
        try:
            with catalogue.writing() as session:
                deed.refuse(session, why + last)
        except StoreError as error:
            log.warning(
                "%s, %s, was refused to %s, which could not be noted: %s", deed.action, deed.target, deed.who, error
            )

    def _number(self, who: str) -> int:
        with self._lock:
            now = self._clock()
            hour = self._hours.get(who)
            if hour is None or now >= hour.ends:
                hour = self._hours[who] = _Hour(now + HOUR)
            hour.noted += 1
            return hour.noted
