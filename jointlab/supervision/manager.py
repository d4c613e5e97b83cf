"""The run manager: carries out one run at a time in a thread of its own, and lets any other thread steer it.

The heartbeat that keeps the tester moving is in this process: where the process dies, the tester stops by itself, and
the run goes on with `resume` when the process is back.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass, field

from jointlab.errors import EXPECTED, ConflictError
from jointlab.supervision.events import BlowWithdrawn, RunEnded, RunStopping
from jointlab.supervision.idle_monitor import IdleWatch
from jointlab.supervision.journal import Journal
from jointlab.supervision.lease import ControlLease
from jointlab.supervision.prompts import AutomaticOperator, Prompt, PromptingOperator
from jointlab.supervision.state import RigState, after, starting
from rig.control import RunControl, RunStoppedError
from rig.events import Event, RunContinued, RunStarted
from rig.instruments import Instruments, save_limits, with_stored_limits
from rig.run import plan_run, resume_run, run_sequence
from rig.sequence import Sequence, sequence_from
from rig.tester_limits import TesterLimits
from rig.tester_monitor import poll_tester
from rig.tester_status import interlock_text
from store.blows import Blow, get_blow, list_blows, withdraw_blow
from store.catalogue import Catalogue
from store.runs import get_run
from store.states import RunState

REDONE = "the point is done anew"
log = logging.getLogger(__name__)


@dataclass
class _Active:
    """The run that is carried out.

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
        hands: that strike and mount, such as those of a simulated bench; None where a person does.

    Attributes:
        journal: every event of every run, for whoever watches.
        lease: who may drive; it is for callers to check, not for the manager.
    """

    def __init__(self, catalogue: Catalogue, instruments: Instruments, hands: AutomaticOperator | None = None) -> None:
        self.journal = Journal()
        self.lease = ControlLease(self.journal)
        self._catalogue = catalogue
        self._instruments = with_stored_limits(instruments, catalogue)
        self._hands = hands
        self._lock = threading.RLock()
        self._telling = threading.Lock()  # for the state alone: nobody waits for the store or the rig within it
        self._asking = threading.Lock()  # one stop at a time where no run drives the tester
        self._active: _Active | None = None
        self._thread: threading.Thread | None = None
        self._state = RigState()
        url = instruments.tester_url
        self._watch = IdleWatch(None if url is None else lambda: poll_tester(url), lambda: self._state, self._observe)

    @property
    def state(self) -> RigState:
        """What the rig is at."""
        return self._state

    @property
    def prompt(self) -> Prompt | None:
        """What the operator is asked to do now."""
        active = self._active
        return None if active is None else active.operator.prompt

    @property
    def instruments(self) -> Instruments:
        """The rig's instruments, with the limits in force."""
        return self._instruments

    def set_limits(self, limits: TesterLimits, who: str) -> None:
        """Let runs that begin from now on keep to `limits`; the tester keeps to its own whatever these are.

        Raises:
            StoreError: they cannot be stored; the former ones stay in force.
        """
        with self._lock:
            self._instruments = save_limits(self._instruments, self._catalogue, limits, who)

    def plan(self, sequence: Sequence, who: str) -> int:
        """Store a run that `start` carries out; its number.

        Raises:
            RigError: a step asks for what cannot be.
            StoreError: it cannot be stored.
        """
        return plan_run(sequence, self._instruments.limits, self._catalogue, who)

    def start(self, run_id: int, who: str, *, automatic: bool = False, reset: bool = False) -> None:
        """Begin a run that was planned; returns when it has begun, that is when its instruments have answered.

        Args:
            run_id: its number.
            who: asks for it.
            automatic: whether the rig's own hands do what the operator is asked for, without asking.
            reset: whether to reset a tester that has tripped, because its cause has been seen to.

        Raises:
            ConflictError: another run is carried out, or this one was begun before.
            RigError, DaqError: the instruments do not answer or do not fit.
            StoreError: there is no such run, or it cannot be stored.
        """
        sequence = self._sequence_of(run_id, {RunState.CREATED})

        def carry_out(active: _Active) -> None:
            run_sequence(
                sequence, self._instruments, self._catalogue, active.operator, self._observe, active.control,
                planned=run_id, reset=reset, who=who,
            )  # fmt: skip

        self._begin(run_id, sequence, automatic, carry_out)

    def resume(self, run_id: int, who: str, *, automatic: bool = False, reset: bool = False) -> None:
        """Let a paused run go on, or one that was stopped, failed or lost its process.

        Raises:
            ConflictError: another run is carried out, or there is nothing to resume.
            RigError, DaqError, StoreError: as for `start`.
        """
        with self._lock:
            if self._active is not None and self._active.run_id == run_id:
                self._active.control.resume()
                return
        sequence = self._sequence_of(run_id, {RunState.STOPPED, RunState.FAILED, RunState.RUNNING})

        def carry_out(active: _Active) -> None:
            resume_run(
                run_id, self._instruments, self._catalogue, active.operator, self._observe, active.control,
                reset=reset, who=who,
            )  # fmt: skip

        self._begin(run_id, sequence, automatic, carry_out)

    def pause(self, run_id: int) -> None:
        """Hold the run where it is; returns with the actuator at rest.

        Raises:
            ConflictError: this run is not carried out.
            RigError: the tester did not confirm that the actuator is at rest.
        """
        self._steered(run_id).control.pause()

    def stop(self, run_id: int | None = None) -> int | None:
        """End whatever is carried out, or run `run_id`; returns its number, with the actuator at rest.

        None where nothing is carried out, which is no error: a stop may be asked for at any time, and again. The tester
        is then halted all the same, as somebody else may move it.

        Raises:
            ConflictError: `run_id` is given and not carried out.
            RigError: the tester did not confirm that the actuator is at rest.
        """
        active = self._active if run_id is None else self._steered(run_id)
        if active is None:
            if self._instruments.tester_url is not None:
                with self._asking, self._watch.kept_off(), self._instruments.tester() as tester:
                    tester.halt()
            return None
        self._observe(RunStopping(active.run_id))
        try:
            active.control.stop()
        finally:
            active.operator.release()
        return active.run_id

    def answer(self, run_id: int, prompt: int) -> None:
        """What the operator was asked for is done.

        Raises:
            ConflictError: this run is not carried out, or asks for something else.
        """
        self._steered(run_id).operator.answer(prompt)

    def withdraw_blow(self, blow_id: int, reason: str, who: str) -> Blow:
        """Take an accepted blow back; a session that is still on strikes its point once more.

        Raises:
            ConflictError: the blow does not count already.
            NotFoundError: there is no such blow.
        """
        with self._catalogue.writing() as session:
            blow = get_blow(session, blow_id)
            if not blow.accepted:
                raise ConflictError(f"blow {blow_id} does not count already: {blow.reason}")
            withdrawn = withdraw_blow(session, blow_id, reason, who)
        assert withdrawn.run_id is not None, "a stored blow belongs to a run"
        self._observe(BlowWithdrawn(withdrawn.run_id, str(withdrawn.point), withdrawn.number, reason))
        return withdrawn

    def redo_point(self, run_id: int, set_number: int, point: str, who: str) -> int:
        """Take back all blows that count at a point; the session strikes it anew, now or when the run is resumed.

        Returns:
            How many they were.

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
                withdraw_blow(session, blow.id, REDONE, who)
        for blow in own:
            self._observe(BlowWithdrawn(run_id, point, blow.number, REDONE))
        return len(own)

    def acknowledge_interlocks(self) -> tuple[str, ...]:
        """Reset the tester, because the cause of its trip has been seen to; names of what had tripped.

        Raises:
            ConflictError: a run is carried out.
            RigError: the tester does not answer, or trips again.
        """
        with self._lock:
            if self._active is not None:
                raise ConflictError(f"run {self._active.run_id} is carried out; stop it first")
            with self._watch.kept_off(), self._instruments.tester() as tester, tester.telling(self._observe):
                tripped = tester.status().interlocks
                if not tripped:
                    return ()
                tester.reset()
        return tuple(interlock_text(tripped).split(", "))

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until nothing is carried out; whether that came about within `timeout` s."""
        thread = self._thread
        if thread is None:
            return True
        thread.join(timeout)
        return not thread.is_alive()

    def close(self) -> None:
        """Stop what is carried out, with the actuator at rest, and tell nobody anything any more."""
        try:
            if self._active is not None:
                self.stop()
        finally:
            self.wait()
            self._watch.close()
            self.journal.close()

    def _sequence_of(self, run_id: int, states: set[RunState]) -> Sequence:
        with self._catalogue.reading() as session:
            run = get_run(session, run_id)
        if run.state not in states:
            raise ConflictError(f"run {run_id} is {run.state}; it would have to be {' or '.join(sorted(states))}")
        return sequence_from(run.sequence, f"sequence of run {run_id}")

    def _steered(self, run_id: int) -> _Active:
        active = self._active
        if active is None or active.run_id != run_id:
            raise ConflictError(f"run {run_id} is not being carried out here")
        return active

    def _begin(self, run_id: int, sequence: Sequence, automatic: bool, carry_out: Callable[[_Active], None]) -> None:
        with self._lock:
            if self._active is not None:
                raise ConflictError(f"run {self._active.run_id} is carried out; there is one rig")
            operator = PromptingOperator(self._observe, self._hands, automatic=automatic)
            active = self._active = _Active(run_id, RunControl(), operator)
            with self._telling:
                self._state = starting(self._state, sequence, run_id)
            self._thread = threading.Thread(
                target=self._work, args=(active, carry_out), name=f"run {run_id}", daemon=True
            )
            self._thread.start()
        active.known.wait()
        if not active.begun and active.error is not None:
            raise active.error

    def _work(self, active: _Active, carry_out: Callable[[_Active], None]) -> None:
        ended, reason = RunState.FINISHED, None
        try:
            with self._watch.kept_off():  # the run says what the tester is at
                carry_out(active)
        except RunStoppedError as stopped:
            active.error = stopped
            ended, reason = RunState.STOPPED, str(stopped)
        except EXPECTED as error:
            active.error = error
            ended, reason = RunState.FAILED, str(error)
        except Exception as error:
            log.exception("run %s ended in a way that nobody expected", active.run_id)
            active.error = error
            ended, reason = RunState.FAILED, f"{type(error).__name__}: {error}"
            raise
        finally:
            active.operator.release()
            self._active = None
            self._observe(RunEnded(active.run_id, ended.value, reason))
            active.known.set()

    def _observe(self, event: Event) -> None:
        active = self._active
        with self._telling:
            self._state = after(self._state, event)
        self.journal(event)
        if self._hands is not None:
            self._hands.observe(event)
        if isinstance(event, RunStarted | RunContinued) and active is not None:
            active.begun = True
            active.known.set()
