"""The control lease: its holder drives the rig, and nobody else does; a stop needs none.

It is in the memory of the program that steers the rig, and timed by a monotonic clock. When this program ends, the
drive process withdraws the lease; a run goes on there, or ends, as `when_alone` in the settings says.
"""

import logging
import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from jointlab.background import BackgroundThread
from jointlab.errors import ConflictError
from rig.errors import RigError

DURATION = 60.0  # s
LOOK = 1.0  # s between two looks whether the lease has ended by itself
log = logging.getLogger(__name__)


LetDrive = Callable[[str | None, bool], int]
"""Lets a holder drive, and nobody else; returns the number of the lease. The arguments are the holder, None for nobody,
and whether the lease is taken by force where another program drives the rig."""


class LeaseError(ConflictError):
    """The rig is driven by another client, or by none yet."""


class ForeignLeaseError(LeaseError):
    """A client of another key drives, and this one may not take over."""


@dataclass(frozen=True)
class Lease:
    """The right to drive for `seconds` more.

    Attributes:
        token: identifies the client that holds it.
        holder: name of that client, to show to others.
        number: of the lease; every request that moves the rig carries it, and requests with an earlier one are refused.
    """

    token: str
    holder: str
    seconds: float
    number: int


class ControlLease:
    """The lease of one rig. Any thread may call it.

    It belongs to one client, which its token distinguishes from every other: a script, or one tab of the page. Several
    clients may have one key; `caller` is the name of the key of a client. A lease lasts for `DURATION` s, unless it is
    taken for longer.

    Args:
        let_drive: asks the drive process for the lease of this program.
        clock: monotonic, s.
        ended: tells the drive process that the lease of this program has ended by itself.
    """

    def __init__(
        self,
        let_drive: LetDrive,
        clock: Callable[[], float] = time.monotonic,
        ended: Callable[[], object] = lambda: None,
    ) -> None:
        self._let_drive = let_drive
        self._ended = ended
        self.number = 0
        self._clock = clock
        self._lock = threading.RLock()  # for the lease alone: no thread waits for the drive process within it
        self._taking = threading.RLock()  # one change of the holder at a time
        self._token: str | None = None
        self._holder = ""
        self._caller = ""
        self._ends = 0.0

    @property
    def holder(self) -> str | None:
        """The present holder; None: nobody drives."""
        return self._holder if self._token is not None and self._clock() < self._ends else None

    @property
    def caller(self) -> str | None:
        """Name of the key of the present holder; None: nobody drives."""
        return None if self.holder is None else self._caller

    def take(
        self,
        holder: str,
        caller: str,
        *,
        token: str | None = None,
        by_force: bool = False,
        from_others: bool = False,
        lasts: float | None = None,
    ) -> Lease:
        """Take the lease where it is free.

        Args:
            holder: name of the client, to show to others.
            caller: name of its key.
            token: of a client that has one already; by default a new one.
            by_force: also where another client of the same key has the lease.
            from_others: with `by_force`, also where a client of another key has it, or another program drives.
            lasts: s until it ends where it is not renewed; None: `DURATION`.

        Raises:
            LeaseError: another client drives; the message says which, and for how long.
            ForeignLeaseError: it was to be taken by force, and belongs to a client of another key.
        """
        with self._taking:
            if by_force and not from_others and self.caller not in (None, caller):
                raise ForeignLeaseError(
                    f"{self._holder} drives the rig; only a key with the scope engineer can take it over from "
                    "another key"
                )
            if not by_force:
                self._check_free(caller)
            everywhere = by_force and from_others
            number = self._let_drive(holder, everywhere)  # in the drive process first: nobody else moves the rig then
            with self._lock:
                self.number = number
                self._token, self._holder, self._caller = token or secrets.token_urlsafe(16), holder, caller
                return self._extend(lasts)

    def hold(self, token: str, holder: str, caller: str) -> Lease:
        """Extend the lease of the client with this token, or take it where it is free.

        Raises LeaseError where another client drives; the message says which, and for how long.
        """
        with self._taking:
            with self._lock:
                if self._is_held_by(token):
                    return self._extend()
            return self.take(holder, caller, token=token)

    def renew(self, token: str | None) -> Lease:
        """Extend the lease. Raises LeaseError where `token` is not that of the lease, or it has ended."""
        with self._lock:
            self.check(token)
            return self._extend()

    def keep(self, token: str | None) -> bool:
        """Extend the lease if `token` is that of its holder; returns whether it is."""
        with self._lock:
            held = self._is_held_by(token)
            if held:
                self._extend()
            return held

    def check(self, token: str | None) -> int:
        """Check the right to drive; returns the number of the lease.

        Raises LeaseError where `token` is not that of the lease, or it has ended.
        """
        with self._lock:
            if self.holder is None:
                raise LeaseError("nobody drives the rig; take the control lease first")
            if not self._is_held_by(token):
                raise LeaseError(f"{self._holder} drives the rig; wait until the control lease is free")
            return self.number

    def release(self, token: str | None) -> None:
        """End the lease. Raises LeaseError where `token` is not that of the lease, or it has ended."""
        with self._taking:
            self.check(token)
            with self._lock:
                self._token = None
            self.number = self._let_drive(None, False)

    def give_back_ended(self) -> None:
        """Let other programs take the rig where the lease has ended by itself; tried again where that is not heard."""
        with self._taking:
            if self._token is None or self.holder is not None:
                return
            try:
                self._ended()
            except RigError as error:
                log.info("the end of the control lease is told later: %s", error)
                return
            with self._lock:
                self._token = None

    def take_again(self, number: int) -> None:
        """Take the lease of the present holder in another drive process, where the lease with `number` is in force.

        Raises what `let_drive` raises; nobody drives through this program then.
        """
        with self._taking:
            if self.holder is None:
                self.number = number
                return
            try:
                self.number = self._let_drive(self.holder, False)
            except BaseException:
                with self._lock:
                    self._token = None
                raise

    def _is_held_by(self, token: str | None) -> bool:
        if self.holder is None or token is None or self._token is None:
            return False
        return secrets.compare_digest(token.encode(), self._token.encode())

    def _check_free(self, caller: str) -> None:
        if self.holder is not None:
            left = self._ends - self._clock()
            own = "; it uses your key, so you may take over" if caller == self._caller else ""
            raise LeaseError(f"{self._holder} drives the rig for another {left:.0f} s or longer{own}")

    def _extend(self, lasts: float | None = None) -> Lease:
        seconds = DURATION if lasts is None else lasts
        self._ends = self._clock() + seconds
        assert self._token is not None
        return Lease(self._token, self._holder, seconds, self.number)


class LeaseEnd(BackgroundThread):
    """Gives a lease back that has ended by itself, unless the rig `is_busy`, until it is closed."""

    def __init__(self, lease: ControlLease, is_busy: Callable[[], bool]) -> None:
        self._lease, self._is_busy = lease, is_busy
        super().__init__("lease end")

    def _run(self) -> None:
        while not self._closed.wait(LOOK):
            if not self._is_busy():
                self._lease.give_back_ended()
