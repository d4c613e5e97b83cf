"""Driving one rig: one run at a time in a thread of its own, its operator's prompts, its events, and STOP."""

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import count

from analysis.dof import Dof
from daq.channels import Channel
from jointlab.drive.events import (
    BlowWithdrawn,
    ExaminationEnded,
    LeaseChanged,
    RunEnded,
    RunStopping,
    StopLatched,
    StopReset,
)
from jointlab.drive.halter import Halter
from jointlab.drive.idle_monitor import IdleMonitor
from jointlab.drive.journal import Journal
from jointlab.drive.phase import Phase
from jointlab.drive.prompts import PromptingOperator
from jointlab.drive.protocol import Snapshot
from jointlab.drive.state import NOT_READ, RigState, after, starting
from jointlab.errors import EXPECTED, ConflictError
from jointlab.logs import everything_belongs_to
from rig.checks.examination import Examination, Examined, examine
from rig.checks.live import LiveBlock, input_range, live_block
from rig.control import RunControl
from rig.errors import RigError, RunStoppedError, failure_reason, with_notes
from rig.events import Event, RestSeen, RestUnknown, RunContinued, RunStarted
from rig.fair_lock import FairLock
from rig.instruments import NOT_DRIVEN, Instruments
from rig.numbering import first_number
from rig.registers import Interlock
from rig.runs.records import RunOrder, RunRecords
from rig.runs.run import carry_out, reset_tester
from rig.tester.limits import TesterLimits
from rig.tester.monitor import is_seen_at_rest, poll_tester
from store.states import RunState

RecordsOf = Callable[[RunOrder], AbstractContextManager[RunRecords]]
"""Opens the records of a run, and closes them when the context is left."""
GONE_INTERVAL = 0.2  # s between two looks whether the program that begins a run still waits for it
NOBODY_WAITS = "the program that began it did not wait until it had begun"
STOPPED_SINCE = (
    "STOP was pressed since this was asked for, or the drive process was restarted; look at the rig, then ask again"
)
log = logging.getLogger(__name__)


@dataclass
class _Active:
    """The present run.

    Attributes:
        known: set once it is known whether the run has begun.
        begun: whether it has begun.
        is_stopping: whether it was asked to end, or STOP was pressed while it was carried out.
        error: why it was stopped or failed; None while it is carried out, and where it has finished.
    """

    run_id: int
    control: RunControl
    operator: PromptingOperator
    known: threading.Event = field(default_factory=threading.Event)
    begun: bool = False
    is_stopping: bool = False
    error: Exception | None = None


class DrivenRig:
    """One rig and what moves it. Any thread may call it.

    Args:
        records_of: opens the records of a run.

    Attributes:
        name, tester_url: of the rig.
        lease: number of the lease in force.
        halter: STOP; `press` latches it.
    """

    def __init__(self, instruments: Instruments, records_of: RecordsOf) -> None:
        self.journal = Journal()
        self.name, self.tester_url = instruments.rig, instruments.tester_url
        self._instruments = instruments
        self._latch = instruments.latch
        self._records_of = records_of
        self._lock = FairLock()  # of the instruments; fair, so that a run begins however often channels are looked at
        self._lease_lock = threading.Lock()  # of the number of the lease; taken before the latch and the state
        self._state_lock = threading.RLock()  # for the state alone: no thread waits for the rig within it
        url = instruments.driven_url
        self._state = RigState(tester_silent=None if url is None else NOT_READ, is_driven=url is not None)
        self._active: _Active | None = None
        self._examining: RunControl | None = None
        self._last: _Active | None = None
        self._thread: threading.Thread | None = None
        self._prompt_numbers = count(first_number())  # of all runs: no answer fits a later prompt
        self.lease, self._holder = first_number(), ""
        self._latch.let_drive(self.lease)
        self.halter = Halter(self._latch_stop, self._halt, is_driven=url is not None)
        poll = None if url is None else partial(poll_tester, url, instruments.tester_map)
        self._idle_monitor = IdleMonitor(poll, lambda: self._state, self._observe)

    def snapshot(self) -> Snapshot:
        """The present state of the rig; waits for nothing that takes time."""
        active = self._active
        with self._state_lock:
            return Snapshot(
                self.journal.latest,
                self._state,
                None if active is None else active.operator.prompt,
                self._latch.in_force,
                self._holder or None,
                None if active is None else active.control.pause_number,
                self._latch.epoch,
            )

    def take_lease(self, holder: str | None) -> int:
        """Let `holder` drive, and no other; returns the number of the new lease. None: nobody drives."""
        with self._lease_lock:
            number = self.lease + 1
            self._latch.let_drive(number)  # before the state is locked: a thread that holds the latch may wait for that
            with self._state_lock:
                self.lease = number
                changed, self._holder = self._holder != (holder or ""), holder or ""
                if changed:
                    self._observe(LeaseChanged(holder))
            return number

    def end_lease(self) -> None:
        """Note that nobody drives any more; what was asked for with the lease is done all the same."""
        with self._lease_lock, self._state_lock:
            if self._holder:
                self._holder = ""
                self._observe(LeaseChanged(None))

    def begin(
        self,
        order: RunOrder,
        limits: TesterLimits,
        lease: int,
        has_gone: Callable[[], bool] = lambda: False,
        *,
        stop_epoch: int | None = None,
    ) -> None:
        """Carry out a run, or go on with it; returns when it has begun, that is when its instruments have answered.

        Where the program that asks `has_gone` before, the run does not begin: nobody would expect the rig to move.
        `stop_epoch` is the number of the last STOP that was seen before this was asked for; None: not known.

        Raises:
            ConflictError: another run is carried out, or STOP `stop_epoch` is not the last one.
            RunStoppedError, LeaseLostError: STOP is in force, or another client has taken the rig.
            RigError, DaqError: the instruments do not answer or do not fit.
            StoreError: its records cannot be written.
        """
        control = RunControl(self._latch, lease)  # before it waits: a STOP after this is the end of this run
        with self._lock:
            if self._active is not None:
                raise ConflictError(f"run {self._active.run_id} is in progress; wait until it has ended, or stop it")
            control.begin()
            if stop_epoch not in (None, control.epoch):
                raise ConflictError(STOPPED_SINCE)
            active = self._active = _Active(
                order.run_id, control, PromptingOperator(self._observe, self._prompt_numbers)
            )
            with self._state_lock:
                self._state = starting(self._state, order.sequence, order.run_id)
            work = partial(
                self._work, active, order, replace(self._instruments, limits=limits, unused=self._idle_monitor.resumed)
            )
            self._thread = threading.Thread(target=work, name=f"run {order.run_id}", daemon=True)
            self._thread.start()
        while not active.known.wait(GONE_INTERVAL):
            if has_gone():
                with suppress(ConflictError):  # it has ended by itself
                    self.end(order.run_id, NOBODY_WAITS)
                active.known.wait()
        if not active.begun and active.error is not None:
            raise active.error

    def pause(self, run_id: int) -> int:
        """Pause the run; returns the number of the pause, with the actuator at rest.

        Raises ConflictError where this run is not carried out, RigError where rest was not confirmed.
        """
        active = self._active_run(run_id)
        try:
            return active.control.pause()
        finally:
            active.operator.hold(active.control.has_pressure)

    def resume(self, run_id: int, lease: int, pause: int) -> None:
        """Let a run go on whose pause number `pause` is in force.

        Raises ConflictError where this run is not carried out, or is being stopped; PauseOverError where another pause
        is in force, or none; RunStoppedError and LeaseLostError as `begin`.
        """
        active = self._active_run(run_id)
        self._latch.check(lease)  # first: a STOP in force says more than that the run ends
        # it would end all the same, also where the STOP that ends it was reset since
        if active.is_stopping or self._state.phase is Phase.STOPPING:
            raise ConflictError(f"run {run_id} is still being stopped; resume it when it has ended")
        active.control.resume(lease, pause)
        active.operator.go_on()

    def end(self, run_id: int, why: str | None = None, who: str | None = None) -> None:
        """End the run; returns with the actuator at rest. `why` is given where no person asks for it, else `who`.

        Raises ConflictError where this run is not carried out, RigError where rest was not confirmed.
        """
        active = self._active_run(run_id)
        self._observe(RunStopping(run_id))
        self._end(active, why, who)

    def answer(self, run_id: int, prompt: int, lease: int) -> None:
        """Confirm that the operator has done what prompt number `prompt` asks for.

        Raises ConflictError where this run is not carried out, or another prompt is open; RunStoppedError and
        LeaseLostError as `begin`.
        """
        active = self._active_run(run_id)
        self._latch.check(lease)  # and not held: the operator tells the observer, which waits for the state
        active.operator.answer(prompt)

    def fail_prompt(self, run_id: int, prompt: int, reason: str) -> None:
        """Let the run fail because the operator cannot do what the prompt asks for; ConflictError as for `answer`."""
        active = self._active_run(run_id)
        active.operator.fail(prompt, reason)
        active.control.pause()  # what waits for a blow is interrupted, and asks the operator once more
        active.control.resume()

    def withdraw(self, run_id: int, set_number: int, point: str, blow: int, reason: str) -> None:
        """Withdraw an accepted blow; a session that is still at its set asks for another one."""
        active = self._active
        if active is not None and active.run_id == run_id:
            active.control.withdraw(set_number, Dof.parse(point), blow)
        self._observe(BlowWithdrawn(run_id, point, blow, reason))

    def reset_stop(self, epoch: int, lease: int) -> None:
        """Release the latch of STOP `epoch`; nothing moves by this.

        Raises StopNotResetError where that STOP is not the one in force, LeaseLostError where another client drives.
        """
        self._latch.reset(epoch, lease)
        self._observe(StopReset())

    def acknowledge(self, lease: int) -> Interlock:
        """Reset the tester, because the cause of its trip is removed; returns the interlocks that had fired.

        Raises:
            ConflictError: a run is carried out.
            LeaseLostError: another client drives.
            RigError: the tester does not answer, or trips again.
        """
        with self._lock:
            if self._active is not None:
                raise ConflictError(f"run {self._active.run_id} is in progress; stop it first")
            self._latch.check_lease(lease)
            with self._idle_monitor.suspended():
                return reset_tester(self._instruments, self._observe)

    def examine(self, asked: Examination, lease: int) -> Examined:
        """Examine instruments and channels; a run that is asked for meanwhile begins afterwards.

        Raises:
            ConflictError: a run is carried out.
            RunStoppedError, LeaseLostError: STOP is in force, or another client drives.
            RigError, DaqError: what `asked` needs is missing.
        """
        control = RunControl(self._latch, lease)  # before it waits, as a run
        with self._lock:
            if self._active is not None:
                raise ConflictError(f"run {self._active.run_id} is in progress; examine the rig after it")
            control.begin()
            self._examining = control
            try:
                with self._idle_monitor.suspended():
                    return examine(self._instruments, asked, self._observe, control)
            finally:
                self._examining = None
                self._observe(ExaminationEnded())

    def look(self, channel: str, lease: int) -> LiveBlock:
        """Look at a channel for a moment; a run that is asked for meanwhile begins after that.

        Raises:
            ConflictError: the instruments are in use.
            LeaseLostError: another client drives.
            DaqError: the acquisition does not answer, or has no such channel.
        """
        with self._looking(lease):
            return live_block(self._instruments, channel)

    def input_range(self, channel: Channel, lease: int) -> tuple[float, float]:
        """Ends of the range of the input of `channel`, in its unit; it need not be in the channel table.

        Raises as `look`; ChannelError also where the input does not take what the channel asks for.
        """
        with self._looking(lease):
            return input_range(self._instruments, channel)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels that runs measure with."""
        return self._instruments.channels

    @contextmanager
    def _looking(self, lease: int) -> Iterator[None]:
        """Keep the acquisition from others for a moment; raises as `look` where they have it."""
        if not self._lock.acquire(0):
            raise ConflictError("the instruments are in use at this moment; try again")
        try:
            if self._active is not None:
                raise ConflictError(f"run {self._active.run_id} is in progress; look at the channels after it")
            self._latch.check_lease(lease)
            yield
        finally:
            self._lock.release()

    def check_outcome(self) -> None:
        """Raise the error with which the last run ended, where it was stopped or failed."""
        if self._last is not None and self._last.error is not None:
            raise self._last.error

    @property
    def is_at_work(self) -> bool:
        """Whether a run is carried out."""
        return self._active is not None

    @property
    def may_move(self) -> bool:
        """Whether a run is carried out or the rig is examined."""
        return self._active is not None or self._examining is not None

    def end_safely(self, why: str) -> None:
        """End the present run, if there is one, and wait until it has ended; `why` goes to the log."""
        active, thread = self._active, self._thread
        if active is not None and thread is not None:
            log.warning("run %s is ended: %s", active.run_id, why)
            try:
                with suppress(ConflictError):  # it has ended by itself meanwhile
                    self.end(active.run_id, why)
            finally:
                thread.join()

    def close(self) -> None:
        """End the present run, with the actuator at rest, then the monitor, the halter and the journal."""
        try:
            self.end_safely("the drive process is ended")
        finally:
            self._idle_monitor.close()
            self.halter.close()
            self.journal.close()

    def _latch_stop(self, who: str, why: str, by_person: bool) -> None:
        before = self._latch.in_force
        self._latch.stop(who, why, by_person=by_person)
        active = self._active
        if active is not None:
            active.is_stopping = True  # before the latch can be reset: halting follows in another thread
        if before is None:
            self._observe(StopLatched(who, why))
            if active is not None:
                self._observe(RunStopping(active.run_id))

    def _halt(self) -> None:
        try:
            self._bring_to_rest()
        except Exception as error:
            # reported before STOP is answered; a reason that the driver has already reported stays
            if self._instruments.driven_url is not None and self._state.rest_unknown is None:
                self._observe(RestUnknown(with_notes(str(error), error)))
            raise

    def _bring_to_rest(self) -> None:
        active, examining, url = self._active, self._examining, self._instruments.driven_url
        is_used = active is not None or examining is not None
        rests = False
        if active is not None:
            self._end(active)  # the control knows the STOP, also where that was reset since
            rests = active.control.saw_rest
        elif examining is not None:
            examining.stop()
            rests = examining.saw_rest
        if url is not None and not rests:
            self._halt_tester(url, is_used)
        if self._instruments.is_external:
            raise RigError(f"STOP did not stop the machine: {NOT_DRIVEN}. Press its own stop. Recording has ended")

    def _halt_tester(self, url: str, is_used: bool) -> None:
        """Halt the tester, where the end of a run or examination has not shown it at rest.

        Where it `is_used`, the thread of the run or examination may just connect or disconnect, and commands from two
        threads would disturb each other. So the status is read first, and nothing is commanded if it shows rest.
        """
        with self._idle_monitor.suspended():
            if is_used and self._is_seen_at_rest(url):
                self._observe(RestSeen())
                return
            self._instruments.stop_tester(self._observe)

    def _is_seen_at_rest(self, url: str) -> bool:
        try:
            return is_seen_at_rest(url, self._instruments.tester_map)
        except RigError as error:
            log.warning("the tester is told to stop, as its status cannot be read: %s", error)
            return False

    def _end(self, active: _Active, why: str | None = None, who: str | None = None) -> None:
        active.is_stopping = True
        try:
            active.control.stop(why, who)
        finally:
            active.operator.release()

    def _active_run(self, run_id: int) -> _Active:
        active = self._active
        if active is None or active.run_id != run_id:
            raise ConflictError(f"run {run_id} is not being carried out here")
        return active

    def _work(self, active: _Active, order: RunOrder, instruments: Instruments) -> None:
        ended, reason = RunState.FINISHED, None
        try:
            # the run itself reports the state of the tester
            with (
                everything_belongs_to(run=active.run_id),
                self._idle_monitor.suspended(),
                self._records_of(order) as records,
            ):
                if self._state.is_tripped:  # somebody may have reset them since the last poll
                    self._idle_monitor.look()
                reason = carry_out(order, instruments, active.operator, records, self._observe, active.control)
        except RunStoppedError as stopped:
            active.error = stopped
            why = active.control.automatic_stop_reason or str(stopped)
            ended, reason = RunState.STOPPED, with_notes(why, stopped)
        except Exception as error:
            active.error = error
            ended, reason = RunState.FAILED, failure_reason(error, EXPECTED)
            if not isinstance(error, EXPECTED):
                log.exception("run %s ended with an unexpected error", active.run_id)
        finally:
            active.operator.release()
            if not active.begun and order.begun_with is None:
                ended = RunState.CREATED  # it has not begun, and may be started again
            self._active, self._last = None, active
            self._observe(RunEnded(active.run_id, ended, reason))
            active.known.set()

    def _observe(self, event: Event) -> None:
        active = self._active
        with self._state_lock:
            if isinstance(event, RestSeen) and self._state.rest_unknown is None:
                return  # every stop that is confirmed says so
            self._state = after(self._state, event)
            self.journal(event)
        if isinstance(event, RunStarted | RunContinued) and active is not None:
            active.begun = True
            active.known.set()
