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

from api.errors import ConflictError
from api.runs.events import LeaseChanged
from rig.operator import Observer

DURATION = 60.0  # s


class LeaseError(ConflictError):
    """The rig is driven by somebody else, or by nobody yet."""


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
    """The lease of one rig. Any thread may call it."""

    def __init__(self, observer: Observer, clock: Callable[[], float] = time.monotonic) -> None:
        self._observer = observer
        self._clock = clock
        self._lock = threading.Lock()
        self._token: str | None = None
        self._holder = ""
        self._ends = 0.0

    @property
    def holder(self) -> str | None:
        """Who drives now; None is nobody."""
        return self._holder if self._token is not None and self._clock() < self._ends else None

    def take(self, holder: str, *, by_force: bool = False) -> Lease:
        """Take the lease for `DURATION` s where it is free; by force also where somebody has it.

        Raises:
            LeaseError: somebody drives; it is said who, and for how long.
        """
        with self._lock:
            if self.holder is not None and not by_force:
                left = self._ends - self._clock()
                raise LeaseError(f"{self._holder} drives the rig for {left:.0f} s more, unless that is renewed")
            self._token, self._holder = secrets.token_urlsafe(16), holder
            self._observer(LeaseChanged(holder))
            return self._lasting()

    def renew(self, token: str | None) -> Lease:
        """Go on driving for `DURATION` s from now.

        Raises:
            LeaseError: `token` is not that of the lease, or it has ended.
        """
        with self._lock:
            self._check(token)
            return self._lasting()

    def check(self, token: str | None) -> None:
        """Let whoever drives pass.

        Raises:
            LeaseError: `token` is not that of the lease, or it has ended.
        """
        with self._lock:
            self._check(token)

    def give_back(self, token: str | None) -> None:
        """Drive no more.

        Raises:
            LeaseError: `token` is not that of the lease, or it has ended.
        """
        with self._lock:
            self._check(token)
            self._token = None
            self._observer(LeaseChanged(None))

    def _check(self, token: str | None) -> None:
        if self.holder is None:
            raise LeaseError("nobody drives the rig; take the control lease first")
        if token is None or self._token is None or not secrets.compare_digest(token.encode(), self._token.encode()):
            raise LeaseError(f"{self._holder} drives the rig; wait until the control lease is free")

    def _lasting(self) -> Lease:
        self._ends = self._clock() + DURATION
        assert self._token is not None
        return Lease(self._token, self._holder, DURATION)
