"""The run manager: plans, begins and resumes runs of the catalogue on the rig that a drive process drives.

It is a client of that process. When this program hangs or dies, the drive process goes on by itself; the next manager
finds it as it is, and takes over what it has recorded meanwhile.
"""

import logging
import math
import threading
import time
from contextlib import suppress
from dataclasses import replace

from jointlab.drive.endpoint import NoDriveError
from jointlab.drive.events import RunEnded
from jointlab.drive.journal import Journal, event_of
from jointlab.drive.phase import Phase
from jointlab.drive.process import SPOOLS
from jointlab.drive.prompts import Prompt
from jointlab.drive.protocol import (
    INTERLOCKS,
    SNAPSHOT,
    Acknowledge,
    AnswerPrompt,
    Ask,
    AskOutcome,
    Begin,
    End,
    FailPrompt,
    News,
    Pause,
    Reply,
    Request,
    ResetStop,
    Resume,
    Snapshot,
    StopNow,
    Welcome,
    Withdraw,
)
from jointlab.drive.state import RigState
from jointlab.errors import ConflictError
from jointlab.instruments import instruments_of
from jointlab.runs.ingest import SETTLED, Ingester
from jointlab.runs.orders import order_to_begin, order_to_resume, plan_run
from jointlab.settings import Settings, drive_folder
from jointlab.supervision.automatic_operator import AutomaticOperator, Obeying, obey
from jointlab.supervision.drive_link import DriveLink
from jointlab.supervision.lease import ControlLease
from jointlab.supervision.stored_limits import save_limits, with_stored_limits
from rig.errors import RigError
from rig.events import BlowAccepted, BlowRefused, RunContinued, RunStarted, SinePointMeasured
from rig.instruments import Instruments
from rig.records import RunOrder
from rig.registers import Interlock
from rig.sequence import Sequence
from rig.stop_latch import Stop
from rig.tester_limits import TesterLimits
from store.blows import Blow, get_blow, list_blows, withdraw_blow
from store.catalogue import Catalogue
from store.errors import StoreError
from store.runs import discard_run, get_run, list_provisional_runs
from store.states import RunState

REPEATED = "the point is measured again"
"""Why the blows of a point that is repeated do not count; stored with each of them."""
BEGIN_TIMEOUT = 120.0  # s that the instruments of a run may take to answer
REST_TIMEOUT = 30.0  # s that a pause or a stop may take
STORE_TIMEOUT = 1.0  # s that news wait until what they tell of can be read from the catalogue
NEWS_TIMEOUT = 2.0  # s that a caller waits until this program knows what it has done
STORED = {kind.__name__ for kind in (BlowAccepted, BlowRefused, RunContinued, RunEnded, RunStarted, SinePointMeasured)}
"""Events that tell of something in the catalogue."""
log = logging.getLogger(__name__)


class RunManager:
    """Carries out runs on one rig, one at a time. Any thread may call it.

    Args:
        catalogue: where runs are.
        settings: with the rig's instruments.
        automatic_operator: strikes and mounts, on a simulated bench say; None where a person does.
        name: of this program, for the messages of others.
        starts: whether a drive process is started where none runs.

    Attributes:
        journal: every event of every run, for observers.
        lease: who may drive; callers check it, and pass its number on with what moves the rig.

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
        self.journal = Journal()
        self.lease = ControlLease(self._let_drive)
        self._catalogue = catalogue
        self._instruments = with_stored_limits(instruments_of(settings), catalogue)
        self._limits_lock = threading.Lock()
        self._automatic_operator = automatic_operator
        self._automatic = False  # whether the operator obeys without an answer
        self._automatic_runs = set[int]()  # that were begun so
        self._obeying = Obeying(self._obey, self._fail)
        self._obeyed = 0, 0
        self._ingester = Ingester(catalogue, drive_folder(settings) / SPOOLS)
        self._is_late = False  # whether what was measured is not in the database soon enough to wait for it
        self._snapshot = Snapshot()
        self._heard = threading.Condition()
        self._link = DriveLink(settings, name, self._hear, self._lose, self._find, starts=starts)
        self._find(self._link.welcome)
        try:
            self._discard_abandoned()
        except (StoreError, RigError) as error:
            log.warning("runs that were stored and did not begin stay: %s", error)

    @property
    def state(self) -> RigState:
        """The state of the rig."""
        return self._snapshot.state

    @property
    def stopped_by(self) -> Stop | None:
        """The STOP that is in force."""
        return self._snapshot.stop

    @property
    def drive(self) -> Welcome:
        """Where the drive process listens for STOP."""
        return self._link.welcome

    @property
    def records_wait(self) -> str | None:
        """Why what was measured cannot be stored at present; None where it can."""
        return self._ingester.problem

    @property
    def prompt(self) -> Prompt | None:
        """The present request to the operator; a strike of the automatic one waits for the answer, too."""
        prompt = self._snapshot.prompt
        if prompt is None or self._automatic_operator is None:
            return prompt
        return None if self._automatic else replace(prompt, waits=True)

    @property
    def has_automatic_operator(self) -> bool:
        """Whether a program can strike and mount here."""
        return self._automatic_operator is not None

    @property
    def not_stored(self) -> str | None:
        """Why records of runs wait in their spools; None where they do not."""
        return self._ingester.problem

    @property
    def instruments(self) -> Instruments:
        """The rig's instruments, with the limits in force."""
        return self._instruments

    def set_limits(self, limits: TesterLimits, who: str) -> None:
        """Apply `limits` to runs that begin from now on; the limits of the tester itself apply beside them.

        Raises StoreError where they cannot be stored; the former ones stay in force.
        """
        with self._limits_lock:
            self._instruments = save_limits(self._instruments, self._catalogue, limits, who)

    def plan(self, sequence: Sequence, who: str) -> int:
        """Store a run that `start` carries out later; returns its number.

        Raises RigError where a step asks for something impossible, StoreError where it cannot be stored.
        """
        return plan_run(sequence, self._instruments.limits, self._catalogue, who, rig=self._instruments.rig).id

    def run(self, sequence: Sequence, who: str, *, reset: bool = False) -> int:
        """Begin a run that was not planned; returns its number when it has begun. Where it does not, nothing is stored.

        Raises ConflictError, LeaseLostError, RunStoppedError, RigError, DaqError, StoreError: as for `start`.
        """
        run = plan_run(
            sequence, self._instruments.limits, self._catalogue, who, rig=self._instruments.rig, provisional=True
        )
        try:
            self._begin(
                order_to_begin(run, rig=self._instruments.rig, reset=reset, who=who, planned=False),
                False,
                self.lease.number,
            )
        except Exception:
            with self._catalogue.writing() as session:
                if any(each.id == run.id for each in list_provisional_runs(session, self._instruments.rig)):
                    discard_run(session, run.id)
            raise
        return run.id

    def check_outcome(self) -> None:
        """Raise the error with which the last run ended, where it was stopped or failed."""
        self._ask(AskOutcome())

    def start(
        self, run_id: int, who: str, *, automatic: bool = False, reset: bool = False, lease: int | None = None
    ) -> None:
        """Begin a run that was planned; returns when it has begun, that is when its instruments have answered.

        Args:
            run_id: its number.
            who: asks for it.
            automatic: whether the automatic operator does everything without prompts.
            reset: whether to reset a tester that has tripped, because the cause is removed.
            lease: number of the lease that was checked; None: the present one.

        Raises:
            ConflictError: another run is being carried out, or this one has begun before.
            LeaseLostError, RunStoppedError: another client has taken the rig, or STOP is in force.
            RigError, DaqError: the instruments do not answer or do not fit.
            StoreError: there is no such run, or it cannot be stored.
        """
        lease = self._present(lease)
        with self._catalogue.reading() as session:
            run = get_run(session, run_id)
        if run.state is not RunState.CREATED:
            raise ConflictError(f"run {run_id} is {run.state}; only a run that was created can be started")
        self._begin(order_to_begin(run, rig=self._instruments.rig, reset=reset, who=who), automatic, lease)

    def resume(
        self, run_id: int, who: str, *, automatic: bool | None = None, reset: bool = False, lease: int | None = None
    ) -> None:
        """Continue a run that is paused, was stopped, failed, or lost its process.

        Args:
            run_id, who, reset, lease: as for `start`.
            automatic: as for `start`; None: as it was begun by this program.

        Raises:
            ConflictError: another run is being carried out.
            ResumeError: there is nothing to resume.
            LeaseLostError, RunStoppedError, RigError, DaqError, StoreError: as for `start`.
        """
        lease = self._present(lease)
        if self.state.run_id == run_id and self.state.phase is not Phase.IDLE:
            self._ask(Resume(run_id=run_id, lease=lease))
            return
        self._ingester.settle()
        limits = self._instruments.limits
        self._begin(
            order_to_resume(self._catalogue, run_id, limits, rig=self._instruments.rig, reset=reset, who=who),
            run_id in self._automatic_runs if automatic is None else automatic,
            lease,
        )

    def pause(self, run_id: int) -> None:
        """Pause the run; returns with the actuator at rest.

        Raises ConflictError where this run is not being carried out, RigError where the tester did not confirm that the
        actuator is at rest.
        """
        self._ask(Pause(run_id=run_id), REST_TIMEOUT)

    def stop(self, run_id: int | None = None, who: str = "unknown caller") -> int | None:
        """STOP, or end run `run_id`; returns the number of the run, with the actuator at rest.

        STOP is latched: nothing moves until `reset_stop`. It halts the tester also where no run is carried out, as
        another client may move it. To end a run latches nothing.

        Raises ConflictError where `run_id` is given and not being carried out, RigError where the tester did not
        confirm that the actuator is at rest.
        """
        if run_id is not None:
            self._ask(End(run_id=run_id), REST_TIMEOUT)
            return run_id
        reply = self._ask(StopNow(who=who, why="STOP was pressed"), REST_TIMEOUT)
        now = SNAPSHOT.validate_python(self._link.ask(Ask()).value)  # a further STOP is no event, only a higher epoch
        with self._heard:
            self._snapshot = now
        return None if reply.value is None else int(reply.value)

    def reset_stop(self, epoch: int, lease: int | None = None) -> None:
        """Release STOP number `epoch`; nothing moves by this.

        Raises StopNotResetError where a newer STOP came, LeaseLostError where another client drives.
        """
        self._ask(ResetStop(epoch=epoch, lease=self._present(lease)))

    def answer(self, run_id: int, prompt: int, lease: int | None = None) -> None:
        """Confirm that the operator has done what prompt number `prompt` asks for.

        Raises ConflictError where this run is not being carried out, or another prompt is open.
        """
        lease, shown = self._present(lease), self._snapshot
        if self._automatic_operator is not None and shown.prompt is not None and shown.prompt.number == prompt:
            if self._obeyed == (run_id, prompt):
                raise ConflictError(f"prompt {prompt} is not what is asked for now; it was answered")
            obey(self._automatic_operator, shown.prompt)
            if not shown.prompt.waits:
                self._obeyed = run_id, prompt
                return
        self._ask(AnswerPrompt(run_id=run_id, prompt=prompt, lease=lease))

    def fail_prompt(self, run_id: int, prompt: int, reason: str) -> None:
        """Let the run fail because the operator cannot do what prompt number `prompt` asks for.

        Raises ConflictError where this run is not being carried out, or another prompt is open.
        """
        self._ask(FailPrompt(run_id=run_id, prompt=prompt, reason=reason))

    def withdraw_blow(self, blow_id: int, reason: str, who: str) -> Blow:
        """Withdraw an accepted blow; a session that is still running asks for one more blow at its point.

        Raises ConflictError where the blow does not count already, NotFoundError where there is no such blow.
        """
        with self._catalogue.writing() as session:
            blow = get_blow(session, blow_id)
            if not blow.accepted:
                raise ConflictError(f"blow {blow_id} does not count already: {blow.reason}")
            withdrawn = withdraw_blow(session, blow_id, reason, who)
        self._withdrawn(withdrawn, reason)
        return withdrawn

    def repeat_point(self, run_id: int, set_number: int, point: str, who: str) -> int:
        """Withdraw all accepted blows at a point; the session repeats it, now or when the run is resumed.

        Returns:
            The number of blows withdrawn.

        Raises:
            ConflictError: the run is finished, or no blow counts there.
            NotFoundError: there is no such run.
        """
        with self._catalogue.writing() as session:
            if get_run(session, run_id).state is RunState.FINISHED:
                raise ConflictError(f"run {run_id} is finished; measure {point} again as a run of its own")
            struck = [blow for blow in list_blows(session, run_id) if blow.accepted and str(blow.point) == point]
            own = [blow for blow in struck if blow.set_number == set_number]
            if not own:
                raise ConflictError(f"no blow counts at {point} in set {set_number} of run {run_id}; strike it")
            for blow in own:
                assert blow.id is not None, "a stored blow has a number"
                withdraw_blow(session, blow.id, REPEATED, who)
        for blow in own:
            self._withdrawn(blow, REPEATED)
        return len(own)

    def acknowledge_interlocks(self, lease: int | None = None) -> Interlock:
        """Reset the tester, because the cause of its trip is removed; returns the interlocks that had fired.

        Raises ConflictError where a run is being carried out; RigError where the tester does not answer, or trips
        again.
        """
        reply = self._ask(Acknowledge(lease=self._present(lease)), REST_TIMEOUT)
        return INTERLOCKS.validate_python(reply.value)

    def check_drive(self, timeout: float) -> None:
        """Ask the drive process for a sign of life. Raises NoDriveError where there is none within `timeout` s."""
        self._link.ask(Ask(), timeout)

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until no run is carried out and all is stored; whether that came about within `timeout` s."""
        end = math.inf if timeout is None else time.monotonic() + timeout
        with self._heard:
            idle = self._heard.wait_for(lambda: self.state.phase is Phase.IDLE, timeout)
        return idle and self._ingester.settle(min(end - time.monotonic(), SETTLED))

    def close(self) -> None:
        """Stop the present run, with the actuator at rest, where this program has started the drive process."""
        try:
            if self._link.is_owner and self.state.phase is not Phase.IDLE and self.state.run_id is not None:
                with suppress(ConflictError):  # it has ended, and the news of that are on their way
                    self.stop(self.state.run_id)
                self.wait(REST_TIMEOUT)
        finally:
            self._link.close()
            self._obeying.close()
            self._ingester.settle(STORE_TIMEOUT)
            self._ingester.close()
            self.journal.close()

    def _discard_abandoned(self) -> None:
        """Remove the runs that were stored to be begun at once, by a program that was killed before that.

        They are read first: where nobody drives after that, nobody is about to begin one of them.
        """
        rig = self._instruments.rig
        with self._catalogue.reading() as session:
            found = {run.id for run in list_provisional_runs(session, rig)}
        if not found or not self._ingester.settle(STORE_TIMEOUT):
            return
        now = SNAPSHOT.validate_python(self._link.ask(Ask()).value)
        if now.holder is not None or now.state.phase is not Phase.IDLE:
            return
        with self._catalogue.writing() as session:
            for run in list_provisional_runs(session, rig):
                if run.id in found:
                    discard_run(session, run.id)

    def _present(self, lease: int | None) -> int:
        return self.lease.number if lease is None else lease

    def _let_drive(self, holder: str | None) -> int:
        try:
            return self._link.take_lease(holder)
        except NoDriveError:
            if holder is not None:
                raise
            return self.lease.number  # where nothing drives, nothing is to be released

    def _begin(self, order: RunOrder, automatic: bool, lease: int) -> None:
        before, self._automatic = self._automatic, automatic and self._automatic_operator is not None
        if self.state.phase is Phase.IDLE:
            self._obeyed = 0, 0  # prompts are counted again
        if self._automatic:
            self._automatic_runs.add(order.run_id)
        try:
            self._ask(Begin(order=order, limits=self._instruments.limits, lease=lease), BEGIN_TIMEOUT)
        except ConflictError:
            self._automatic = before  # another run goes on
            raise
        finally:
            self._ingester.settle(STORE_TIMEOUT)

    def _withdrawn(self, blow: Blow, reason: str) -> None:
        assert blow.run_id is not None, "a stored blow belongs to a run"
        request = Withdraw(
            run_id=blow.run_id, set_number=blow.set_number, point=str(blow.point), blow=blow.number, reason=reason
        )
        try:
            self._ask(request)
        except NoDriveError as error:
            log.warning("no session was told of a withdrawn blow: %s", error)

    def _ask(self, request: Request, timeout: float | None = None) -> Reply:
        """The reply to a request, when what it did is known here, too."""
        reply = self._link.ask(request) if timeout is None else self._link.ask(request, timeout)
        with self._heard:
            self._heard.wait_for(lambda: self.journal.latest >= reply.latest, NEWS_TIMEOUT)
        return reply

    def _hear(self, news: News) -> None:
        """Take over what has happened."""
        after = self.journal.latest if news.epoch == self.journal.epoch else 0
        entries = [entry for entry in news.entries if entry.number > after]
        if self._automatic_operator is not None:
            for entry in entries:
                self._automatic_operator.observe(event_of(entry))
        if any(entry.name in STORED for entry in entries):
            self._is_late = not self._ingester.settle(0.0 if self._is_late else STORE_TIMEOUT)
        with self._heard:
            self._snapshot = news.snapshot
            self.journal.mirror(news.epoch, entries)
            self._heard.notify_all()
        prompt, run_id = news.snapshot.prompt, news.snapshot.state.run_id
        if self._automatic and prompt is not None and news.snapshot.latest <= self.journal.latest:
            this = (run_id or 0, prompt.number)
            if this != self._obeyed:
                self._obeyed = this
                self._obeying(prompt)

    def _lose(self, why: str) -> None:
        """Show that nothing is known of the rig."""
        with self._heard:
            state = self._snapshot.state
            self._snapshot = Snapshot(state=RigState(run_id=state.run_id, title=state.title, tester_silent=why))
            self._heard.notify_all()

    def _find(self, welcome: Welcome) -> None:
        try:
            self.lease.take_again(welcome.lease)
        except (RigError, ConflictError) as error:
            log.warning("the control lease is lost: %s", error)

    def _obey(self, prompt: Prompt) -> None:
        assert self._automatic_operator is not None
        obey(self._automatic_operator, prompt)
        if prompt.waits:
            request = AnswerPrompt(run_id=self._obeyed[0], prompt=prompt.number, lease=self.lease.number)
            self._link.ask(request)

    def _fail(self, prompt: Prompt, reason: str) -> None:
        self._link.ask(FailPrompt(run_id=self._obeyed[0], prompt=prompt.number, reason=reason))
