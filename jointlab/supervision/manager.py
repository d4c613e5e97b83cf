"""The run manager: plans, begins and resumes runs of the catalogue on the rig that a drive process drives.

It is a client of that process. When this program hangs or dies, the drive process goes on by itself; the next manager
finds it as it is, and takes over what it has recorded meanwhile.
"""

import logging
import math
import threading
import time
from collections.abc import Callable
from collections.abc import Sequence as Several
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path

from daq.channels import Channel
from jointlab.commissioning.examination import examine_rig, sign
from jointlab.drive.endpoint import NoDriveError, UnansweredError
from jointlab.drive.events import RunEnded
from jointlab.drive.journal import Entry, Journal
from jointlab.drive.phase import Phase
from jointlab.drive.process import SPOOLS
from jointlab.drive.prompts import Prompt
from jointlab.drive.protocol import (
    INPUT_RANGE,
    INTERLOCKS,
    LIVE_BLOCK,
    Acknowledge,
    AnswerPrompt,
    Ask,
    AskInputRange,
    AskOutcome,
    Begin,
    End,
    FailPrompt,
    LookAtChannel,
    Pause,
    ResetStop,
    Resume,
    StopNow,
    Welcome,
)
from jointlab.drive.state import RigState
from jointlab.errors import ConflictError
from jointlab.instruments import instruments_of
from jointlab.runs.ingest import SETTLED, Ingester
from jointlab.runs.orders import order_to_begin, order_to_resume, plan_run
from jointlab.settings import Settings, drive_folder
from jointlab.supervision.automatic_operator import AutomaticOperator, Automation, is_automatic
from jointlab.supervision.drive_mirror import NEWS_TIMEOUT, DriveMirror
from jointlab.supervision.lease import ControlLease, LeaseEnd
from jointlab.supervision.provisional_runs import discard_abandoned, discard_failed
from jointlab.supervision.shared_request import SharedRequest
from jointlab.supervision.stored_limits import save_limits, with_stored_limits
from jointlab.supervision.withdrawals import Withdrawals
from rig.checks.examination import Examination
from rig.checks.live import LiveBlock
from rig.errors import RigError
from rig.events import BlowAccepted, BlowRefused, RunContinued, RunStarted, SinePointMeasured
from rig.instruments import Instruments
from rig.registers import Interlock
from rig.runs.records import RunOrder
from rig.sequences.sequence import Sequence
from rig.sequences.steps import check_channels
from rig.tester.limits import TesterLimits
from rig.tester.stop_latch import Stop
from store.catalogue import Catalogue
from store.errors import StoreError
from store.measurements.runs import get_run
from store.service.commissioning import CommissioningRecord
from store.states import RunState

BEGIN_TIMEOUT = 120.0  # s that the instruments of a run may take to answer
REST_TIMEOUT = 30.0  # s that a pause or a stop may take
STOPS = 4  # STOPs at a time that take a connection to the drive process; it has 48
STORE_TIMEOUT = 1.0  # s that news wait until what they tell of can be read from the catalogue
STORED = {kind.__name__ for kind in (BlowAccepted, BlowRefused, RunContinued, RunEnded, RunStarted, SinePointMeasured)}
"""Events that tell of something in the catalogue."""
log = logging.getLogger(__name__)


class RunManager:
    """Carries out runs on one rig, one at a time. Any thread may call it.

    Args:
        settings: with the rig's instruments.
        automatic_operator: strikes and mounts, for example on a simulated bench; None if a person does.
        name: of this program, for the messages of others.
        starts: whether a drive process is started where none runs.

    Attributes:
        lease: who may drive; callers check it, and pass its number on with what moves the rig.
        commissioning: what the rig is examined with, and for how long that holds.
        withdrawals: of blows, also those of a run that is carried out.

    Raises:
        RigError: no drive process answers, and none can be started.
    """

    def __init__(
        self,
        catalogue: Catalogue,
        settings: Settings,
        automatic_operator: AutomaticOperator | None = None,
        *,
        name: str = "the service",
        starts: bool = True,
    ) -> None:
        self.lease = ControlLease(self._let_drive, ended=lambda: self._link.end_lease())
        self.commissioning = settings.commissioning
        self._catalogue = catalogue
        self._instruments = with_stored_limits(instruments_of(settings), catalogue)
        self._limits_lock = threading.Lock()
        self._automation = Automation(
            automatic_operator, lambda request: self._link.ask(request), lambda: self.lease.number
        )
        self._ingester = Ingester(catalogue, drive_folder(settings) / SPOOLS)
        self._shared_stop = SharedRequest(self._stop, STOPS)
        self._is_late = False  # whether measurements reach the database too late to wait for them
        with ExitStack() as begun:  # closed where the rest fails
            begun.callback(self._ingester.close)
            begun.callback(self._automation.close)
            self._mirror = DriveMirror(
                settings,
                name,
                before=self._take_over,
                after=self._automation.look,
                found=self._take_lease_again,
                starts=starts,
            )
            begun.pop_all()
        self._link = self._mirror.link
        self.withdrawals = Withdrawals(catalogue, self._mirror.ask)
        self._lease_end = LeaseEnd(self.lease, lambda: self.state.phase is not Phase.IDLE)
        self._take_lease_again(self._link.welcome)
        try:
            discard_abandoned(
                catalogue, self._instruments.rig, partial(self._ingester.settle, STORE_TIMEOUT), self._mirror.fresh
            )
        except (StoreError, RigError) as error:
            log.warning("runs that were stored and did not begin stay: %s", error)

    @property
    def state(self) -> RigState:
        """The state of the rig."""
        return self._mirror.snapshot.state

    @property
    def journal(self) -> Journal:
        """Every event of every run, for observers."""
        return self._mirror.journal

    @property
    def stopped_by(self) -> Stop | None:
        """The STOP that is in force."""
        return self._mirror.snapshot.stop

    @property
    def pause_number(self) -> int | None:
        """Number of the pause in force; a resume names it."""
        return self._mirror.snapshot.pause

    @property
    def stop_epoch(self) -> int | None:
        """Number of the last STOP, reset or not; None where it is not known."""
        return self._mirror.snapshot.stop_epoch

    @property
    def drive(self) -> Welcome:
        """What the drive process has said of itself: where it listens for STOP, and its channels."""
        return self._link.welcome

    @property
    def drive_folder(self) -> Path:
        """The folder of the drive process, with its spools."""
        return self._link.folder

    @property
    def records_wait(self) -> str | None:
        """Why what was measured cannot be stored at present; None where it can."""
        return self._ingester.problem

    @property
    def prompt(self) -> Prompt | None:
        """The present request to the operator; a strike of the automatic one waits for the answer, too."""
        return self._automation.shown(self._mirror.snapshot)

    @property
    def has_automatic_operator(self) -> bool:
        """Whether a program can strike and mount here."""
        return self._automation.operator is not None

    @property
    def instruments(self) -> Instruments:
        """The rig's instruments, with the limits in force."""
        return self._instruments

    def set_limits(
        self, limits: TesterLimits, who: str, check: Callable[[TesterLimits], None] = lambda _: None
    ) -> None:
        """Apply `limits` to runs that begin from now on; the limits of the tester itself apply beside them.

        `check` is given those in force, which nobody else changes meanwhile, and may raise. Raises StoreError where
        they cannot be stored; the former ones stay in force.
        """
        with self._limits_lock:
            check(self._instruments.limits)
            self._instruments = save_limits(self._instruments, self._catalogue, limits, who)

    def plan(self, sequence: Sequence, who: str) -> int:
        """Store a run that `start` carries out later; returns its number.

        Raises RigError where a step asks for something impossible, ChannelError where a channel is missing or does not
        fit, StoreError where it cannot be stored.
        """
        check_channels(sequence, self._instruments)
        return plan_run(sequence, self._instruments.limits, self._catalogue, who, rig=self._instruments.rig).id

    def run(self, sequence: Sequence, who: str, *, automatic: bool | None = None, reset: bool = False) -> int:
        """Begin a run that was not planned; returns its number when it has begun. Where it does not, nothing is stored.

        It stays stored where the drive process has not answered: the run may begin all the same. Where it does not, the
        next manager removes it. `automatic` is as for `start`; None: where there is an automatic operator.

        Raises ConflictError, LeaseLostError, RunStoppedError, RigError, DaqError, StoreError: as for `start`.
        """
        stop_epoch = self._seen(None)
        run = plan_run(
            sequence, self._instruments.limits, self._catalogue, who, rig=self._instruments.rig, provisional=True
        )
        try:
            self._begin(
                order_to_begin(run, rig=self._instruments.rig, reset=reset, who=who, planned=False),
                self.has_automatic_operator if automatic is None else automatic,
                self.lease.number,
                stop_epoch,
            )
        except UnansweredError as error:
            error.add_note(f"run {run.id} may begin all the same; look at the rig")
            raise
        except Exception as error:
            discard_failed(self._catalogue, self._instruments.rig, run.id, error)
            raise
        return run.id

    def check_outcome(self) -> None:
        """Raise the error with which the last run ended, where it was stopped or failed."""
        self._mirror.ask(AskOutcome())

    def start(
        self, run_id: int, who: str, *, automatic: bool = False, reset: bool = False, lease: int | None = None,
        stop_epoch: int | None = None,
    ) -> None:  # fmt: skip
        """Begin a run that was planned; returns when it has begun, that is when its instruments have answered.

        Args:
            automatic: whether the automatic operator does everything without prompts.
            reset: whether to reset a tester that has tripped, because the cause is removed.
            lease: number of the lease that was checked; None: the present one.
            stop_epoch: number of the last STOP that was seen before this was asked for; None: that of now.

        Raises:
            ConflictError: another run is being carried out, this one has begun before, or STOP was pressed since.
            LeaseLostError, RunStoppedError: another client has taken the rig, or STOP is in force.
            RigError, DaqError: the instruments do not answer or do not fit.
            StoreError: there is no such run, or it cannot be stored.
        """
        lease, stop_epoch = self._present(lease), self._seen(stop_epoch)
        run = self._catalogue.read(get_run, run_id)
        if run.state is not RunState.CREATED:
            raise ConflictError(f"run {run_id} is {run.state}; only a run that was created can be started")
        order = order_to_begin(run, rig=self._instruments.rig, reset=reset, who=who)
        self._begin(order, automatic, lease, stop_epoch)

    def resume(
        self, run_id: int, who: str, *, automatic: bool | None = None, reset: bool = False, lease: int | None = None,
        pause: int | None = None, stop_epoch: int | None = None,
    ) -> None:  # fmt: skip
        """Continue a run that is paused, was stopped, failed, or lost its process.

        Args:
            run_id, who, reset, lease, stop_epoch: as for `start`.
            automatic: as for `start`; None: as it was begun or resumed last, by whichever program.
            pause: number of the pause that is to end; None: the run has ended.

        Raises:
            ConflictError: a run is being carried out or stopped, STOP was pressed since, or records of the run wait.
            PauseOverError: `pause` is over, or the run was paused once more.
            ResumeError: there is nothing to resume.
            LeaseLostError, RunStoppedError, RigError, DaqError, StoreError: as for `start`.
        """
        lease = self._present(lease)
        if pause is not None:
            self._mirror.ask(Resume(run_id=run_id, lease=lease, pause=pause))
            return
        stop_epoch = self._seen(stop_epoch)
        self._mirror.wait_until_ended(run_id)
        is_settled, limits = self._ingester.settle(SETTLED), self._instruments.limits
        order = order_to_resume(self._catalogue, run_id, limits, rig=self._instruments.rig, reset=reset, who=who)
        if not is_settled:
            self._ingester.check_stored(order)
        self._begin(order, automatic, lease, stop_epoch)

    def pause(self, run_id: int) -> int:
        """Pause the run; returns the number of the pause, with the actuator at rest.

        Raises ConflictError where this run is not being carried out, RigError where the tester did not confirm that the
        actuator is at rest.
        """
        number = int(self._mirror.ask(Pause(run_id=run_id), REST_TIMEOUT).value)
        # a further pause is no event; numbers rise
        self._mirror.wait(lambda shown: (shown.pause or 0) >= number, time.monotonic() + NEWS_TIMEOUT)
        return number

    def stop(self, who: str = "unknown caller") -> int | None:
        """STOP; returns the number of the run that it ended, if any, with the actuator at rest.

        STOP is latched: nothing moves until `reset_stop`. It halts the tester also where no run is carried out, as
        another client may move it.

        Raises RigError where the tester did not confirm that the actuator is at rest.
        """
        return self._shared_stop(who)

    def _stop(self, who: str) -> int | None:
        reply = self._mirror.ask(StopNow(who=who, why="STOP was pressed"), REST_TIMEOUT)
        self._mirror.show(self._mirror.fresh())  # a further STOP is no event, only a higher epoch
        return None if reply.value is None else int(reply.value)

    def end_run(self, run_id: int, who: str | None = None) -> None:
        """End the run as stopped by `who`; returns with the actuator at rest. STOP is not latched by this.

        Raises ConflictError where this run is not being carried out, RigError where the tester did not confirm that the
        actuator is at rest.
        """
        self._mirror.ask(End(run_id=run_id, who=who), REST_TIMEOUT)

    def reset_stop(self, epoch: int, lease: int | None = None) -> None:
        """Release STOP number `epoch`; nothing moves by this.

        Raises StopNotResetError where that STOP is not the one in force, LeaseLostError where another client drives.
        """
        self._mirror.ask(ResetStop(epoch=epoch, lease=self._present(lease)))

    def answer(self, run_id: int, prompt: int, lease: int | None = None) -> None:
        """Confirm that the operator has done what prompt number `prompt` asks for.

        Raises ConflictError where this run is not being carried out, or another prompt is open.
        """
        lease, shown = self._present(lease), self._mirror.snapshot.prompt
        if shown is None or shown.number != prompt or self._automation.answer(shown):
            self._mirror.ask(AnswerPrompt(run_id=run_id, prompt=prompt, lease=lease))

    def fail_prompt(self, run_id: int, prompt: int, reason: str) -> None:
        """Let the run fail because the operator cannot do what prompt number `prompt` asks for.

        Raises ConflictError where this run is not being carried out, or another prompt is open.
        """
        self._mirror.ask(FailPrompt(run_id=run_id, prompt=prompt, reason=reason))

    def acknowledge_interlocks(self, lease: int | None = None) -> Interlock:
        """Reset the tester, because the cause of its trip is removed; returns the interlocks that had fired.

        Raises ConflictError where a run is being carried out; RigError where the tester does not answer, or trips
        again.
        """
        reply = self._mirror.ask(Acknowledge(lease=self._present(lease)), REST_TIMEOUT)
        return INTERLOCKS.validate_python(reply.value)

    def examine(self, asked: Examination, who: str, lease: int | None = None) -> CommissioningRecord:
        """Examine instruments and channels, and store what was found as a record that `who` signs.

        Raises:
            ConflictError: a run is being carried out.
            LeaseLostError, RunStoppedError: another client has taken the rig, or STOP is in force.
            RigError, DaqError: what `asked` needs is missing.
            StoreError: the record cannot be stored.
        """
        found = examine_rig(self._mirror.ask, asked, self._present(lease))
        return sign(self._catalogue, self._instruments.rig, asked, found, self._instruments.channels, who)

    def look(self, channel: str, lease: int | None = None) -> LiveBlock:
        """Look at a channel for a moment, while nothing is carried out.

        Raises:
            ConflictError: the instruments are in use.
            LeaseLostError: another client has taken the rig.
            DaqError: the acquisition does not answer, or has no such channel.
        """
        request = LookAtChannel(channel=channel, lease=self._present(lease))
        return LIVE_BLOCK.validate_python(self._link.ask(request).value)

    def input_range(self, channel: Channel, lease: int | None = None) -> tuple[float, float]:
        """Ends of the range of the input of `channel`, in its unit; it need not be in the channel table.

        Raises as `look`; ChannelError also where the input does not take what the channel asks for.
        """
        request = AskInputRange(channel=channel, lease=self._present(lease))
        low, high = INPUT_RANGE.validate_python(self._link.ask(request).value)
        return low, high

    def latest_event(self) -> int:
        """Number of the drive process's latest event; the journal here may hear of it later.

        Raises NoDriveError where the drive process does not answer.
        """
        return self._link.ask(Ask()).latest

    def check_drive(self, timeout: float) -> None:
        """Ask the drive process for a sign of life. Raises NoDriveError where there is none within `timeout` s."""
        self._link.ask(Ask(), timeout)

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until no run is carried out and all is stored; whether that came about within `timeout` s."""
        end = math.inf if timeout is None else time.monotonic() + timeout
        idle = self._mirror.wait(lambda shown: not shown.state.phase.is_of_a_run, end)
        return idle and self._ingester.settle(min(end - time.monotonic(), SETTLED))

    def close(self) -> None:
        """Stop the present run, with the actuator at rest, where this program has started the drive process.

        Raises RigError where the tester did not confirm that; the drive process goes on then, and all else is closed.
        """
        try:
            if self._link.is_owner and self.state.phase.is_of_a_run and self.state.run_id is not None:
                with suppress(ConflictError):  # it has ended, and the news of it is on its way
                    self.end_run(self.state.run_id)
                self.wait(REST_TIMEOUT)
        finally:
            self._lease_end.close()
            self._mirror.close()
            self._automation.close()
            self._ingester.settle(STORE_TIMEOUT)
            self._ingester.close()
            self.journal.close()

    def _present(self, lease: int | None) -> int:
        return self.lease.number if lease is None else lease

    def _let_drive(self, holder: str | None, by_force: bool) -> int:
        try:
            return self._link.take_lease(holder, by_force=by_force)
        except NoDriveError:
            if holder is not None:
                raise
            return self.lease.number  # where nothing drives, nothing is to be released

    def _begin(self, order: RunOrder, automatic: bool | None, lease: int, stop_epoch: int | None) -> None:
        asked = automatic and self.has_automatic_operator
        limits = self._instruments.limits
        request = Begin(order=order, limits=limits, lease=lease, stop_epoch=stop_epoch)
        try:
            with self._automation.beginning(order.run_id, is_automatic(self._catalogue, order.run_id, asked)):
                self._mirror.ask(request, BEGIN_TIMEOUT)
        finally:
            self._ingester.settle(STORE_TIMEOUT)

    def _seen(self, stop_epoch: int | None) -> int | None:
        """The number of the last STOP that a caller has seen; where they do not say it, that of now."""
        return self._mirror.fresh().stop_epoch if stop_epoch is None else stop_epoch

    def _take_over(self, entries: Several[Entry]) -> None:
        """Take over new events, before any observer here gets them."""
        self._automation.observe(entries)
        if any(entry.name in STORED for entry in entries):
            self._is_late = not self._ingester.settle(0.0 if self._is_late else STORE_TIMEOUT)

    def _take_lease_again(self, welcome: Welcome) -> None:
        try:
            self.lease.take_again(welcome.lease)
        except (RigError, ConflictError) as error:
            log.warning("the control lease is lost: %s", error)
