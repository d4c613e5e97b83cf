"""The control lease: whoever holds it drives the rig, and nobody else does; a stop needs none.

It is kept in the memory of the one process that drives, and measured by a clock that nobody can set back: when the
process ends, so does whatever it drove.
"""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from jointlab.errors import ConflictError
from jointlab.supervision.events import LeaseChanged
from rig.events import Observer

DURATION = 60.0  # s


class LeaseError(ConflictError):
    """The rig is driven by somebody else, or by nobody yet."""


class ForeignLeaseError(LeaseError):
    """A client of another key drives, and may not be relieved by this one."""


@dataclass(frozen=True)
class Lease:
    """The right to drive for `seconds` more.

    Attributes:
        token: shows that one holds it.
        holder: who does, in words for others.
    """

    token: str
    holder: str
    seconds: float


class ControlLease:
    """The lease of one rig. Any thread may call it.

    It belongs to one client, which its token tells from every other: a script, or one tab of the page. Several clients
    may have one key; `caller` is the name of a client's key.
    """

    def __init__(self, observer: Observer, clock: Callable[[], float] = time.monotonic) -> None:
        self._observer = observer
        self._clock = clock
        self._lock = threading.Lock()
        self._token: str | None = None
        self._holder = ""
        self._caller = ""
        self._ends = 0.0

    @property
    def holder(self) -> str | None:
        """Who drives now; None is nobody."""
        return self._holder if self._token is not None and self._clock() < self._ends else None

    @property
    def caller(self) -> str | None:
        """Whose key has the client that drives now; None is nobody's."""
        return None if self.holder is None else self._caller

    def take(
        self,
        holder: str,
        caller: str,
        *,
        token: str | None = None,
        by_force: bool = False,
        from_others: bool = False,
    ) -> Lease:
        """Take the lease for `DURATION` s where it is free.

        Args:
            holder: who the client is, in words for others.
            caller: whose key it has.
            token: of a client that has one already; a new one where none is given.
            by_force: also where another client of the same key has it.
            from_others: with `by_force`, also where a client of another key has it.

        Raises:
            LeaseError: somebody drives; it is said who, and for how long.
            ForeignLeaseError: it was asked for by force, and belongs to a client of another key.
        """
        with self._lock:
            if by_force and not from_others and self.caller not in (None, caller):
                raise ForeignLeaseError(f"{self._holder} drives the rig; to take over from another key needs engineer")
            if not by_force:
                self._check_free(caller)
            return self._taken(token or secrets.token_urlsafe(16), holder, caller)

    def hold(self, token: str, holder: str, caller: str) -> Lease:
        """Go on driving for `DURATION` s from now, or take the lease where it is free, for the client with this token.

        Raises:
            LeaseError: another client drives; it is said who, and for how long.
        """
        with self._lock:
            if self._is_held_by(token):
                return self._lasting()
            self._check_free(caller)
            return self._taken(token, holder, caller)

    def renew(self, token: str | None) -> Lease:
        """Go on driving for `DURATION` s from now.

        Raises:
            LeaseError: `token` is not that of the lease, or it has ended.
        """
        with self._lock:
            self._check(token)
            return self._lasting()

    def keep(self, token: str | None) -> bool:
        """Renew the lease where `token` is that of it; whether it is."""
        with self._lock:
            held = self._is_held_by(token)
            if held:
                self._lasting()
            return held

    def check(self, token: str | None) -> None:
        """Let whoever drives pass.

        Raises:
            LeaseError: `token` is not that of the lease, or it has ended.
        """
        with self._lock:
            self._check(token)

    def release(self, token: str | None) -> None:
        """Drive no more.

        Raises:
            LeaseError: `token` is not that of the lease, or it has ended.
        """
        with self._lock:
            self._check(token)
            self._token = None
            self._observer(LeaseChanged(None))

    def _is_held_by(self, token: str | None) -> bool:
        if self.holder is None or token is None or self._token is None:
            return False
        return secrets.compare_digest(token.encode(), self._token.encode())

    def _check(self, token: str | None) -> None:
        if self.holder is None:
            raise LeaseError("nobody drives the rig; take the control lease first")
        if not self._is_held_by(token):
            raise LeaseError(f"{self._holder} drives the rig; wait until the control lease is free")

    def _check_free(self, caller: str) -> None:
        if self.holder is not None:
            left = self._ends - self._clock()
            own = "; that is another client of your own key, and you may take over" if caller == self._caller else ""
            raise LeaseError(f"{self._holder} drives the rig for {left:.0f} s more, unless that is renewed{own}")

    def _taken(self, token: str, holder: str, caller: str) -> Lease:
        self._token, self._holder, self._caller = token, holder, caller
        self._observer(LeaseChanged(holder))
        return self._lasting()

    def _lasting(self) -> Lease:
        self._ends = self._clock() + DURATION
        assert self._token is not None
        return Lease(self._token, self._holder, DURATION)
