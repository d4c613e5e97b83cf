"""The latch that STOP sets: while it is set no motion command is written, and only a deliberate reset releases it.

There is one latch for each rig, in the process that drives it, made when that process starts and given to all that
moves the actuator: `Instruments.latch`, and from there `RunControl` and `Tester`. That process uses it like this:

- STOP, from any thread: `latch.stop(who, why)` first, which never waits for an instrument, then `RunControl.stop` where
  a run is carried out, or else `Tester.halt`. From the moment that `stop` returns no motion command is written.
- What a STOP interrupted never moves again, also where the STOP is reset before it has ended: `RunControl` and `Tester`
  take the number of the last STOP, `latch.epoch`, when they are made, and a newer one is their end.
- Reset, asked for by the holder of the lease: `latch.reset(epoch, lease)` with the epoch that was shown to this person.
  It fails where a newer STOP came, or another client holds the lease now.
- Lease: `latch.let_drive(lease)` with a new number each time that another client takes it. A start and a resume carry
  the number of the lease that they were asked for with (`RunControl(latch, lease)`, `RunControl.resume(lease)`).
- Numbers of STOPs begin at a random one: a request that names a STOP of an earlier process fits none of this one.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from rig.errors import RequestError, RigError, RunStoppedError
from rig.numbering import first_number

LONGEST_TEXT = 200  # characters kept of who and why: callers may send anything, a latch has constant memory


class StopNotResetError(RequestError):
    """The STOP that was to be reset is not the one in force; nothing was reset."""


class LeaseLostError(RigError):
    """Another client has taken the right to drive the rig since this was asked for; nothing moved."""


@dataclass(frozen=True)
class Stop:
    """A STOP in force.

    Attributes:
        epoch: its number, which rises with every STOP; each process begins at another one.
        who, why: who asked for it last, and why.
        by_person: whether that was a person; a lost line of a STOP button is none.
    """

    epoch: int
    who: str
    why: str
    by_person: bool

    @property
    def reason(self) -> str:
        """Why it ends a run, in words."""
        return f"STOP by {self.who}: {self.why}"


class StopLatch:
    """The STOP of one rig. Any thread and a signal handler may call it; no call waits for an instrument."""

    def __init__(self) -> None:
        self._lock = threading.RLock()  # a signal handler may interrupt the thread that holds it
        self._epoch = first_number()
        self._stop: Stop | None = None
        self._last: Stop | None = None
        self._lease: int | None = None

    @property
    def in_force(self) -> Stop | None:
        """The STOP that is in force; None where there is none."""
        return self._stop

    @property
    def epoch(self) -> int:
        """Number of the last STOP, reset or not; one that no STOP has where there was none."""
        return self._epoch

    def stop_since(self, epoch: int) -> Stop | None:
        """The last STOP that is in force or came after STOP `epoch`, reset or not; None where there is none."""
        last = self._last
        return last if last is not None and last.epoch > epoch else self._stop

    def stop(self, who: str, why: str, *, by_person: bool = True) -> Stop:
        """Set the latch; when this returns, no motion command is written until it is reset."""
        with self._lock:
            self._epoch += 1
            self._stop = self._last = Stop(self._epoch, who[:LONGEST_TEXT], why[:LONGEST_TEXT], by_person)
            return self._stop

    def restore(self, stop: Stop) -> None:
        """Set the latch by a STOP that an earlier process has left; it gets a number of this process."""
        with self._lock:
            self._epoch += 1
            self._stop = self._last = replace(stop, epoch=self._epoch)

    def reset(self, epoch: int, lease: int | None = None) -> None:
        """Release the latch; nothing moves by this.

        Args:
            epoch: of the STOP that was looked at.
            lease: number of the lease of the client that asks; None where the rig has no leases.

        Raises:
            StopNotResetError: another STOP is in force, or none is. A repeat for the last one is no error.
            LeaseLostError: another client holds the lease.
        """
        with self._lock:
            self.check_lease(lease)
            if epoch != self._epoch:
                raise StopNotResetError(self._why_not())
            self._stop = None

    def _why_not(self) -> str:
        if self._stop is None:
            return "there is nothing to reset: no STOP is in force"
        return "another STOP is in force than the one that you have seen; see why it was pressed, then reset that one"

    def let_drive(self, lease: int) -> None:
        """Let only the client with this lease number start, resume and reset; when this returns, no other does."""
        with self._lock:
            self._lease = lease

    def check(self, lease: int | None = None, epoch: int | None = None) -> None:
        """Check that the actuator may move now.

        Raises:
            RunStoppedError: STOP is in force, or came after STOP `epoch` where that is given.
            LeaseLostError: `lease` is given, and not the present one.
        """
        with self.moving(lease, epoch):
            pass

    @contextmanager
    def moving(self, lease: int | None = None, epoch: int | None = None) -> Iterator[None]:
        """Check that the actuator may move; STOP and a change of lease wait until the context is left.

        For the few microseconds in which a command is passed to the operating system; never wait for a reply in it.

        Raises:
            RunStoppedError, LeaseLostError: as for `check`.
        """
        with self._lock:
            stop = self.stop_since(self._epoch if epoch is None else epoch)
            if stop is not None:
                kept, asked = "what was measured before is kept", f"{stop.who}: {stop.why}"
                if self._stop is not None:
                    raise RunStoppedError(f"STOP is in force ({asked}); {kept}. Check the machine, then reset STOP")
                raise RunStoppedError(f"STOP was pressed meanwhile ({asked}), and reset since; {kept}")
            self.check_lease(lease)
            yield

    def check_lease(self, lease: int | None) -> None:
        """Check that `lease` is the present one, STOP or not. Raises LeaseLostError where it is another one."""
        if lease is not None and lease != self._lease:
            raise LeaseLostError("another client has taken the rig since this was asked for; nothing moved")
