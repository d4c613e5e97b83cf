"""The audit log as service and page write it.

An action that moves the machine is noted before it begins; every action is noted with its outcome; a refused action is
noted, too. Refused actions cannot fill the disk: a caller without a valid key is not noted, and of every other caller
only a limited number of refusals is noted in an hour.
"""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from sqlalchemy.orm import Session

from store.catalogue import Catalogue
from store.errors import StoreError
from store.service.audit import add_audit_entry

BEGUN = "begun"
REFUSALS_AN_HOUR = 60
"""The number of refused actions of one caller that are noted in an hour."""
HOUR = 3600.0  # s
ResultT = TypeVar("ResultT")
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class AuditedAction:
    """An action that a caller asks for.

    Attributes:
        caller: name of the caller.
        action: such as "start run".
        target: of the action, such as "run 7".
        moves: whether it moves the machine; it is then noted before it begins, too.
        details: what else was given.
    """

    caller: str
    action: str
    target: str
    moves: bool = False
    details: dict[str, Any] = field(default_factory=dict)

    def begin(self, session: Session) -> int | None:
        """Note that it is about to begin, where it moves the machine; the number of that entry."""
        return self._add(session, BEGUN, self.details) if self.moves else None

    def carry_out(
        self,
        catalogue: Catalogue,
        begun: int | None,
        do: Callable[[], ResultT],
        done: Callable[[Session, ResultT], None] = lambda _session, _result: None,
        failed: Callable[[Session], None] = lambda _session: None,
    ) -> ResultT:
        """Do it, and note its outcome.

        Args:
            begun: number of the entry that it was about to begin.
            done: writes more into the transaction that notes the end.
            failed: the same where `do` raises.

        Raises:
            Exception: what `do` raises.
        """
        begin = {} if begun is None else {BEGUN: begun}
        try:
            result = do()
        except Exception as error:
            why = str(error) or type(error).__name__
            try:
                catalogue.write(lambda session: self._note(session, why, begin, failed))
            except StoreError as unnoted:  # what went wrong first matters more, such as a rest that is not confirmed
                log.warning("%s, %s, failed: %s; this could not be noted: %s", self.action, self.target, why, unnoted)
                error.add_note(f"this is not in the audit log: {unnoted}")
            raise
        catalogue.write(lambda session: self._note(session, "done", begin, lambda within: done(within, result)))
        return result

    def refuse(self, session: Session, reason: str) -> None:
        """Note that it was refused, and not begun."""
        self._add(session, f"refused: {reason}", {})

    def _note(self, session: Session, outcome: str, begin: dict[str, int], more: Callable[[Session], None]) -> None:
        more(session)
        self._add(session, outcome, self.details | begin)

    def _add(self, session: Session, outcome: str, details: dict[str, Any]) -> int:
        return add_audit_entry(
            session, who=self.caller, action=self.action, target=self.target, outcome=outcome, details=details
        )


@dataclass
class _Hour:
    ends: float
    noted: int = 0


class RefusalLog:
    """Notes actions that were refused for lack of a scope or the lease. Any thread may call it.

    A caller who may act can write the log anyway; a key that only reads cannot fill the disk with refusals.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._hours = dict[str, _Hour]()  # one for each key at most

    def note(self, catalogue: Catalogue, action: AuditedAction, reason: str) -> None:
        """Note that `action` was refused. The caller is told so whether or not it can be noted."""
        number = self._number(action.caller)
        if number > REFUSALS_AN_HOUR:
            return
        last = "; no more is noted of them within the hour" if number == REFUSALS_AN_HOUR else ""
        try:
            with catalogue.writing() as session:
                action.refuse(session, reason + last)
        except StoreError as error:
            log.warning(
                "%s, %s, was refused to %s; this could not be noted: %s",
                action.action, action.target, action.caller, error,
            )  # fmt: skip

    def _number(self, caller: str) -> int:
        with self._lock:
            now = self._clock()
            hour = self._hours.get(caller)
            if hour is None or now >= hour.ends:
                hour = self._hours[caller] = _Hour(now + HOUR)
            hour.noted += 1
            return hour.noted
