"""The run manager: carries out one run at a time in a thread of its own; any other thread may pause or stop it.

The heartbeat that allows the tester to move is in this process: when the process dies, the tester stops by itself, and
`resume` continues the run when the process is back.
"""

import logging
import threading
from dataclasses import dataclass, field
from functools import partial

from analysis.dof import Dof
from jointlab.drive.events import BlowWithdrawn, RunEnded, RunStopping
from jointlab.drive.idle_monitor import IdleMonitor
from jointlab.drive.journal import Journal
from jointlab.drive.prompts import AutomaticOperator, Prompt, PromptingOperator
from jointlab.drive.state import RigState, after, starting
from jointlab.errors import EXPECTED, ConflictError
from jointlab.runs.carry_out import CarryOut, resume_run, run_sequence
from jointlab.runs.orders import plan_run
from jointlab.supervision.lease import ControlLease
from jointlab.supervision.stored_limits import save_limits, with_stored_limits
from rig.control import RunControl
from rig.errors import RunStoppedError, failure_reason
from rig.events import Event, RunContinued, RunStarted
from rig.instruments import Instruments
from rig.registers import Interlock
from rig.run import reset_tester
from rig.sequence import Sequence, sequence_from
from rig.tester_limits import TesterLimits
from rig.tester_monitor import poll_tester
from store.blows import Blow, get_blow, list_blows, withdraw_blow
from store.catalogue import Catalogue
from store.runs import get_run
from store.states import RunState

REPEATED = "the point is measured again"
"""Why the blows of a point that is repeated do not count; stored with each of them."""
log = logging.getLogger(__name__)


@dataclass
class _Active:
    """The present run.

    Attributes:
        known: set once it has begun, or has failed to.
        error: why it failed.
    """

    run_id: int
    control: RunControl
    operator: PromptingOperator
    known: threading.Event = field(default_factory=threading.Event)
    begun: bool = False
    error: Exception | None = None


class RunManager:
    """Carries out runs on one rig, one at a time. Any thread may call it.

    Args:
        catalogue: where runs are.
        instruments: of the rig.
        automatic_operator: strikes and mounts, on a simulated bench say; None where a person does.

    Attributes:
        journal: every event of every run, for observers.
        lease: who may drive; callers check it, the manager does not.
    """

    def __init__(
        self, catalogue: Catalogue, instruments: Instruments, automatic_operator: AutomaticOperator | None = None
    ) -> None:
        self.journal = Journal()
        self.lease = ControlLease(self.journal)
        self._catalogue = catalogue
        self._instruments = with_stored_limits(instruments, catalogue)
        self._automatic_operator = automatic_operator
        self._lock = threading.RLock()
        self._state_lock = threading.Lock()  # for the state alone: no thread waits for the store or the rig within it
        self._stop_lock = threading.Lock()  # one stop at a time where no run drives the tester
        self._active: _Active | None = None
        self._thread: threading.Thread | None = None
        self._state = RigState()
        url = instruments.tester_url
        poll = None if url is None else partial(poll_tester, url)
        self._idle_monitor = IdleMonitor(poll, lambda: self._state, self._observe)

    @property
    def state(self) -> RigState:
        """The state of the rig."""
        return self._state

    @property
    def prompt(self) -> Prompt | None:
        """The present request to the operator."""
        active = self._active
        return None if active is None else active.operator.prompt

    @property
    def instruments(self) -> Instruments:
        """The rig's instruments, with the limits in force."""
        return self._instruments

    def set_limits(self, limits: TesterLimits, who: str) -> None:
        """Apply `limits` to runs that begin from now on; the limits of the tester itself apply beside them.

        Raises StoreError where they cannot be stored; the former ones stay in force.
        """
        with self._lock:
            self._instruments = save_limits(self._instruments, self._catalogue, limits, who)

    def plan(self, sequence: Sequence, who: str) -> int:
        """Store a run that `start` carries out later; returns its number.

        Raises RigError where a step asks for something impossible, StoreError where it cannot be stored.
        """
        return plan_run(sequence, self._instruments.limits, self._catalogue, who, rig=self._instruments.rig).id

    def start(self, run_id: int, who: str, *, automatic: bool = False, reset: bool = False) -> None:
        """Begin a run that was planned; returns when it has begun, that is when its instruments have answered.

        Args:
            run_id: its number.
            who: asks for it.
            automatic: whether the automatic operator does everything without prompts.
            reset: whether to reset a tester that has tripped, because the cause is removed.

        Raises:
            ConflictError: another run is being carried out, or this one has begun before.
            RigError, DaqError: the instruments do not answer or do not fit.
            StoreError: there is no such run, or it cannot be stored.
        """
        sequence = self._sequence_of(run_id, {RunState.CREATED})
        self._begin(run_id, sequence, automatic, partial(run_sequence, sequence, planned=run_id, reset=reset, who=who))

    def resume(self, run_id: int, who: str, *, automatic: bool = False, reset: bool = False) -> None:
        """Continue a run that is paused, was stopped, failed, or lost its process.

        Raises:
            ConflictError: another run is being carried out, or there is nothing to resume.
            RigError, DaqError, StoreError: as for `start`.
        """
        with self._lock:
            if self._active is not None and self._active.run_id == run_id:
                self._active.control.resume()
                return
        sequence = self._sequence_of(run_id, {RunState.STOPPED, RunState.FAILED, RunState.RUNNING})
        self._begin(run_id, sequence, automatic, partial(resume_run, run_id, reset=reset, who=who))

    def pause(self, run_id: int) -> None:
        """Pause the run; returns with the actuator at rest.

        Raises ConflictError where this run is not being carried out, RigError where the tester did not confirm that the
        actuator is at rest.
        """
        self._active_run(run_id).control.pause()

    def stop(self, run_id: int | None = None) -> int | None:
        """End the present run, or run `run_id`; returns its number, with the actuator at rest.

        None where no run is carried out, which is no error: a stop may be requested at any time, and again. The tester
        is then halted all the same, as another client may move it. Raises ConflictError where `run_id` is given and not
        being carried out, RigError where the tester did not confirm that the actuator is at rest.
        """
        active = self._active if run_id is None else self._active_run(run_id)
        if active is None:
            if self._instruments.tester_url is not None:
                with self._stop_lock, self._idle_monitor.suspended(), self._instruments.tester() as tester:
                    tester.halt()
            return None
        self._observe(RunStopping(active.run_id))
        try:
            active.control.stop()
        finally:
            active.operator.release()
        return active.run_id

    def answer(self, run_id: int, prompt: int) -> None:
        """Confirm that the operator has done what prompt number `prompt` asks for.

        Raises ConflictError where this run is not being carried out, or another prompt is open.
        """
        self._active_run(run_id).operator.answer(prompt)

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

    def acknowledge_interlocks(self) -> Interlock:
        """Reset the tester, because the cause of its trip is removed; returns the interlocks that had fired.

        Raises ConflictError where a run is being carried out; RigError where the tester does not answer, or trips
        again.
        """
        with self._lock:
            if self._active is not None:
                raise ConflictError(f"run {self._active.run_id} is carried out; stop it first")
            with self._idle_monitor.suspended():
                return reset_tester(self._instruments, self._observe)

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until no run is carried out; whether that came about within `timeout` s."""
        thread = self._thread
        if thread is None:
            return True
        thread.join(timeout)
        return not thread.is_alive()

    def close(self) -> None:
        """Stop the present run, with the actuator at rest, and end the monitor and the journal."""
        try:
            if self._active is not None:
                self.stop()
        finally:
            self.wait()
            self._idle_monitor.close()
            self.journal.close()

    def _sequence_of(self, run_id: int, states: set[RunState]) -> Sequence:
        with self._catalogue.reading() as session:
            run = get_run(session, run_id)
        if run.state not in states:
            raise ConflictError(f"run {run_id} is {run.state}; it would have to be {' or '.join(sorted(states))}")
        return sequence_from(run.sequence, f"sequence of run {run_id}")

    def _withdrawn(self, blow: Blow, reason: str) -> None:
        """Tell the present run, where the blow is one of it, and observers."""
        assert blow.run_id is not None, "a stored blow belongs to a run"
        active, point = self._active, str(blow.point)
        if active is not None and active.run_id == blow.run_id:
            active.control.withdraw(blow.set_number, Dof.parse(point), blow.number)
        self._observe(BlowWithdrawn(blow.run_id, point, blow.number, reason))

    def _active_run(self, run_id: int) -> _Active:
        active = self._active
        if active is None or active.run_id != run_id:
            raise ConflictError(f"run {run_id} is not being carried out here")
        return active

    def _begin(self, run_id: int, sequence: Sequence, automatic: bool, carry_out: CarryOut) -> None:
        with self._lock:
            if self._active is not None:
                raise ConflictError(f"run {self._active.run_id} is carried out; there is one rig")
            operator = PromptingOperator(self._observe, self._automatic_operator, automatic=automatic)
            active = self._active = _Active(run_id, RunControl(self._instruments.latch), operator)
            with self._state_lock:
                self._state = starting(self._state, sequence, run_id)
            self._thread = threading.Thread(
                target=self._work, args=(active, carry_out), name=f"run {run_id}", daemon=True
            )
            self._thread.start()
        active.known.wait()
        if not active.begun and active.error is not None:
            raise active.error

    def _work(self, active: _Active, carry_out: CarryOut) -> None:
        ended, reason = RunState.FINISHED, None
        try:
            with self._idle_monitor.suspended():  # the run itself reports the state of the tester
                carry_out(self._instruments, self._catalogue, active.operator, self._observe, active.control)
        except RunStoppedError as stopped:
            active.error = stopped
            ended, reason = RunState.STOPPED, str(stopped)
        except Exception as error:
            active.error = error
            ended, reason = RunState.FAILED, failure_reason(error, EXPECTED)
            if not isinstance(error, EXPECTED):
                log.exception("run %s ended with an unexpected error", active.run_id)
                raise
        finally:
            active.operator.release()
            self._active = None
            self._observe(RunEnded(active.run_id, ended, reason))
            active.known.set()

    def _observe(self, event: Event) -> None:
        active = self._active
        with self._state_lock:
            self._state = after(self._state, event)
        self.journal(event)
        if self._automatic_operator is not None:
            self._automatic_operator.observe(event)
        if isinstance(event, RunStarted | RunContinued) and active is not None:
            active.begun = True
            active.known.set()
