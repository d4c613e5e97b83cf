"""Pause, resume and stop a run from outside it: from a page, a signal or another thread."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from typing import TypeVar

from analysis.dof import Dof
from daq.errors import AcquisitionCancelledError
from rig.errors import RequestError, RunStoppedError
from rig.events import Observer, RunPaused, RunResumed
from rig.numbering import first_number
from rig.tester.driver import Tester
from rig.tester.rest_judge import POWERLESS
from rig.tester.status import MotionHaltedError
from rig.tester.stop_latch import StopLatch

LOOK = 0.1  # s between two looks at whether the tester of a paused run was given up
_Result = TypeVar("_Result")


class PauseOverError(RequestError):
    """The pause that was to end is not the one in force; nothing moved."""


class RunControl:
    """Requests that a run obeys between and during its steps. Any thread may make them; it controls one run at a time.

    A request acts at once: where the run drives a tester, the actuator is at rest when `pause` or `stop` returns, with
    hydraulics on and the preset kept. A measurement that is interrupted is repeated after `resume`.

    Args:
        latch: of the rig; a STOP after this control was made ends the run, reset or not. While one is in force, no step
            begins. None: a new one that nothing else sets.
        lease: number of the lease with which the run was asked for; None where the rig has no leases.

    Attributes:
        epoch: number of the last STOP before this control was made.
        saw_rest: whether the last request to pause or stop halted a tester, and its actuator was then seen at rest.
    """

    def __init__(self, latch: StopLatch | None = None, lease: int | None = None) -> None:
        self._latch = latch or StopLatch()
        self.epoch = self._latch.epoch
        self._lease = lease
        self._requests = threading.Lock()  # one at a time
        self._may_run = threading.Event()
        self._may_run.set()
        self._stopped = False
        self._why: str | None = None
        self._who: str | None = None
        self._count = 0
        self._numbers = count(first_number())
        self._pause: int | None = None  # number of the last one
        self._tester: Tester | None = None
        self.saw_rest = False
        self._withdrawn = set[tuple[int, Dof, int]]()

    def pause(self) -> int:
        """Hold the run until `resume` or `stop`; each call is a pause of its own, and returns its number.

        Raises RigError where the tester did not confirm that the actuator is at rest; the run stays paused.
        """
        with self._requests:
            self._pause = number = next(self._numbers)
            self._may_run.clear()
            self._interrupt()
            return number

    def begin(self) -> None:
        """Check that the run may still begin; called last, immediately before the first step.

        Raises RunStoppedError where STOP was pressed, LeaseLostError where another client has taken the rig.
        """
        self._latch.check(self._lease, self.epoch)

    @property
    def pause_number(self) -> int | None:
        """Number of the pause in force; None where there is none."""
        return self._pause if self.is_paused() else None

    def resume(self, lease: int | None = None, pause: int | None = None) -> None:
        """Continue a paused run; a stopped run stays stopped.

        Args:
            lease: number of the lease with which this was asked for; None where the rig has no leases.
            pause: number of the pause that is to end; None: whichever is in force.

        Raises:
            RunStoppedError: STOP was pressed.
            LeaseLostError: `lease` is not the present one any more.
            PauseOverError: `pause` is over, or the run was paused once more.
        """
        with self._requests, self._latch.moving(lease, self.epoch):
            if pause not in (None, self.pause_number):
                raise PauseOverError(
                    "the pause that this request ends is over, or the run was paused once more; look at the rig, then "
                    "resume it again"
                )
            if self._tester is not None and not self._stopped:
                self._tester.release()
            self._may_run.set()

    def stop(self, why: str | None = None, who: str | None = None) -> None:
        """End the run, paused or not; it raises `RunStoppedError`.

        Args:
            why: given where no person asks for it.
            who: the person who asks, where that is known.

        Raises RigError where the tester did not confirm that the actuator is at rest; the run ends all the same.
        """
        with self._requests:
            if not self._stopped:
                self._stopped, self._why, self._who = True, why, who
            try:
                self._interrupt()
            finally:
                self._may_run.set()

    def withdraw(self, set_number: int, point: Dof, blow: int) -> None:
        """Withdraw an accepted blow of the run; its point gets another one if the run is still at its set."""
        self._withdrawn = self._withdrawn | {(set_number, point, blow)}

    def withdrawn(self, set_number: int, point: Dof) -> int:
        """Number of accepted blows at a point of a set that were withdrawn while the run is carried out."""
        return sum((number, struck) == (set_number, point) for number, struck, _ in self._withdrawn)

    @property
    def automatic_stop_reason(self) -> str | None:
        """Why the run was stopped where no person asked for it; None where one did, or it was not stopped."""
        stop = self._latch.stop_since(self.epoch)
        if stop is not None:
            return stop.reason if not stop.by_person else None
        return self._why

    @property
    def stopped_by(self) -> str | None:
        """The person who asked for the stop; None where none did, or it is not known who."""
        stop = self._latch.stop_since(self.epoch)
        if stop is not None:
            return stop.who if stop.by_person else None
        return self._who

    def is_paused(self) -> bool:
        """Whether the run is to wait until it is resumed or stopped."""
        return not self._may_run.is_set() and not self._stopped

    def is_interrupted(self) -> bool:
        """Whether the run is to pause or to end."""
        return self._stopped or not self._may_run.is_set() or self._has_stop

    @property
    def _has_stop(self) -> bool:
        return self._latch.stop_since(self.epoch) is not None

    def has_pressure(self) -> bool | None:
        """Whether the hydraulics of the tester are on; None where the run does not drive it at present.

        Raises RigError where the tester does not answer.
        """
        tester = self._tester
        return None if tester is None else tester.status().state not in POWERLESS

    @contextmanager
    def driving(self, tester: Tester) -> Iterator[None]:
        """Let requests halt `tester` while the context lasts.

        Raises RigError where a request came before, and the tester did not confirm that the actuator is at rest.
        """
        try:
            with self._requests:
                self._tester = tester
                if self.is_interrupted():
                    tester.halt()
            yield
        finally:
            with self._requests:
                self._tester = None
                tester.release()

    def carry_out(
        self, step: Callable[[], _Result], observer: Observer, recover: Callable[[], None] = lambda: None
    ) -> _Result:
        """Do `step`; where a pause interrupts it, repeat it after `recover` when the run is resumed.

        Raises:
            RunStoppedError: the run was stopped.
            RigError, DaqError: raised by `step` or `recover`, or why the tester was given up during a pause.
        """
        interrupted = False
        while True:
            self._wait(observer)
            requests = self._count
            if self.is_interrupted():  # by a request that came after the wait, and is counted already
                continue
            try:
                if interrupted:
                    recover()
                return step()
            except (MotionHaltedError, AcquisitionCancelledError):
                if self._count == requests and not self._has_stop:
                    raise  # not because of a request
                interrupted = True

    def _interrupt(self) -> None:
        self._count += 1
        self.saw_rest = False
        if self._tester is not None:
            self._tester.halt()
            self.saw_rest = True

    def _wait(self, observer: Observer) -> None:
        if not self._may_run.is_set():
            began = time.monotonic()
            observer(RunPaused(self.has_pressure()))
            self._wait_for_request()
            if not self._stopped:
                observer(RunResumed(time.monotonic() - began))
        if self._stopped:
            raise RunStoppedError
        self._latch.check(epoch=self.epoch)

    def _wait_for_request(self) -> None:
        """Wait until the run is resumed or stopped. Raises why its tester was given up, where that comes first."""
        tester = self._tester
        while not self._may_run.wait(LOOK):
            if tester is not None and tester.failure is not None:
                raise tester.failure
