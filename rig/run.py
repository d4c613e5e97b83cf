"""Running a sequence: its steps one after the other, each on the instruments that it needs, into one run.

A run that was stopped, failed or lost its process can be resumed with the rest of its sequence: every completed
measurement is in the store, and the store tells the rest.
"""

import logging
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

from analysis.errors import AnalysisError
from daq.errors import DaqError
from rig.completed_points import CompletedPoints, ResumeError, completed_points
from rig.control import RunControl
from rig.errors import RigError, RunStoppedError, failure_reason
from rig.events import HammerStarted, Observer, PromptStarted, RunContinued, RunStarted, ignore_event
from rig.hammer import run_hammer_session
from rig.instruments import Instruments, stored_channel
from rig.operator import BEAM, Operator
from rig.recording import BlowRecorder, SineRecorder
from rig.registers import NO_INTERLOCK, Interlock, interlock_names
from rig.sequence import BlankStep, HammerStep, PromptStep, Sequence, SineStep, SoakStep, Step, SweepStep, sequence_from
from rig.steps import channel_names, channels_of, check_instruments, check_plan, sweep_plan
from rig.sweep import run_sweep
from rig.tester_limits import TesterLimits
from rig.tester_status import interlock_text
from rig.waiting import soak, wait
from store.audit import add_audit_entry
from store.catalogue import Catalogue
from store.deferred_run_end import defer_run_end, store_deferred_end
from store.errors import StoreError
from store.instruments import Instrument, list_channels, list_instruments
from store.locks import discard_run_lock, run_lock
from store.provenance import who_is_here
from store.runs import Run, begin_run, finish_run, get_run, reopen_run, start_run
from store.states import RunState

EXPECTED = (RigError, DaqError, StoreError, AnalysisError)
KIND = "sequence"
RESUMED_WITHOUT_END = (
    "resumed; how it ended before could not be stored: its process was lost, or nothing could be written"
)
LONGEST_RECORD = 12.0  # s, the record that the sweep's task is made for; each record has a length of its own
CarryOut = Callable[[Instruments, Catalogue, Operator, Observer, RunControl], object]
"""`run_sequence` or `resume_run`, when it is known which run to carry out."""
log = logging.getLogger(__name__)


def plan_run(sequence: Sequence, limits: TesterLimits, catalogue: Catalogue, who: str | None = None) -> int:
    """Store a run that `run_sequence` carries out later, and return its number; no instrument is connected.

    Raises PlanError, LimitExceededError where a step asks for something impossible, StoreError where it cannot be
    stored.
    """
    check_plan(sequence, limits)
    with catalogue.writing() as session:
        return start_run(session, **_described(sequence), who=who or who_is_here(), state=RunState.CREATED).id


def run_sequence(
    sequence: Sequence,
    instruments: Instruments,
    catalogue: Catalogue,
    operator: Operator,
    observer: Observer = ignore_event,
    control: RunControl | None = None,
    *,
    planned: int | None = None,
    reset: bool = False,
    who: str | None = None,
) -> int:
    """Run every step of `sequence`; returns the number of the run that holds the measurements.

    The plan and the instruments are checked before a run is stored: where a step exceeds a limit or an instrument is
    absent, nothing is stored. A run that fails or is stopped keeps what was measured and the reason, and can be
    resumed.

    Args:
        sequence: the steps.
        instruments: of the rig.
        catalogue: stores the run.
        operator: strikes and mounts.
        observer: gets events.
        control: may pause and stop the run.
        planned: number of the run that `plan_run` stored for this sequence; None for a new one.
        reset: whether to reset the tester first, because the cause of its trip is removed; the audit log has it even if
            the run does not begin, the history of the run if it does.
        who: for the history of the run; by default the user of this process.

    Raises:
        RunStoppedError: `control` asked for it.
        RigError, DaqError: a step is impossible, or an instrument is absent, refuses or fails.
        StoreError: the measurement cannot be stored.
    """
    control = control or RunControl(instruments.latch)
    sequence = sequence.with_seed()
    check_plan(sequence, instruments.limits)
    who = who or who_is_here()
    target = "new run" if planned is None else f"run {planned}"
    reset_done = _reset(sequence, instruments, catalogue, observer, target, who) if reset else None
    identities = check_instruments(sequence, instruments, observer)
    control.carry_out(lambda: None, observer)  # a stop before this line stores nothing
    with ExitStack() as held:
        named = channel_names(sequence.steps)
        channels = [stored_channel(channel) for channel in instruments.channels if channel.name in named]
        described = _described(sequence)
        begun: dict[str, Any] = {"channels": channels, "instruments": identities, "who": who, "reason": reset_done}
        with catalogue.writing() as session:
            if planned is None:
                run = start_run(session, **described, **begun)
            else:
                run = begin_run(session, planned, sequence=described["sequence"], **begun)
            held.enter_context(run_lock(catalogue, run))  # before another process can see it
        observer(RunStarted(run.id))
        _carry_out(_Work(run, sequence, CompletedPoints(), instruments, catalogue, operator, observer, control))
    return run.id


def resume_run(
    run_id: int,
    instruments: Instruments,
    catalogue: Catalogue,
    operator: Operator,
    observer: Observer = ignore_event,
    control: RunControl | None = None,
    *,
    reset: bool = False,
    who: str | None = None,
) -> None:
    """Continue a run that was stopped, failed or lost its process, at the first point that is not measured.

    Blow and order numbers continue, and so does the time. The history of the run gets an entry.

    Args:
        run_id: number of the run.
        instruments: the same that the run began with.
        catalogue, operator, observer, control, reset, who: as for `run_sequence`; specimens are mounted again.

    Raises:
        RunBusyError: another living process carries out the run.
        ResumeError: the run is finished or was not measured here, or other instruments are connected; nothing moved.
        RunStoppedError: `control` asked for it.
        RigError, DaqError: an instrument is absent, refuses or fails.
        StoreError: there is no such run, or the measurement cannot be stored.
    """
    control = control or RunControl(instruments.latch)
    with catalogue.reading() as session:
        run = get_run(session, run_id)
    with run_lock(catalogue, run):
        store_deferred_end(catalogue, run)
        with catalogue.reading() as session:
            run = get_run(session, run_id)  # again, now that no other process can change it
        if run.kind != KIND or run.state in (RunState.FINISHED, RunState.CREATED):
            why = f"is {run.state}" if run.kind == KIND else "was not measured from a sequence here"
            raise ResumeError(f"run {run_id} {why}; there is nothing to resume")
        sequence = sequence_from(run.sequence, f"sequence of run {run_id}")
        check_plan(sequence, instruments.limits)
        completed = completed_points(catalogue, run, sequence)
        steps = completed.remaining_steps(sequence)
        left = sequence.model_copy(update={"steps": tuple(step for step, _ in steps)})
        reason = RESUMED_WITHOUT_END if run.state is RunState.RUNNING else f"resumed after it was {run.state}"
        who = who or who_is_here()
        if reset and (reset_done := _reset(left, instruments, catalogue, observer, f"run {run_id}", who)):
            reason += f", {reset_done}"
        if steps:
            _check_same(catalogue, run, left, instruments, check_instruments(left, instruments, observer))
        control.carry_out(lambda: None, observer)
        with catalogue.writing() as session:
            run = reopen_run(session, run_id, reason, who)
        observer(RunContinued(run.id, completed.blows, len(completed.sines)))
        _carry_out(_Work(run, sequence, completed, instruments, catalogue, operator, observer, control))


@dataclass(frozen=True)
class _Work:
    """The steps of one run."""

    run: Run
    sequence: Sequence
    completed: CompletedPoints
    instruments: Instruments
    catalogue: Catalogue
    operator: Operator
    observer: Observer
    control: RunControl

    def do(self, step: Step, number: int) -> None:
        """Carry out what is left of a step."""
        match step:
            case HammerStep():
                self._hammer(step, number)
            case SweepStep() | BlankStep():
                self._sweep(step, number)
            case SoakStep():
                with self.instruments.acquisition() as (_, thermometer):
                    soak(step, thermometer, self.observer, self.control)
            case PromptStep():
                self.observer(PromptStarted(step.text))
                self.control.carry_out(lambda: self.operator.do_task(step.text), self.observer)
            case _:
                wait(step.seconds, self.observer, self.control)

    def _hammer(self, step: HammerStep, set_number: int) -> None:
        channels = channels_of(step, self.instruments)
        if self.sequence.hangs_beam:
            self.operator.mount(BEAM, step.beam)
        self.observer(HammerStarted(set_number, step.peak_force))
        with self.instruments.acquisition() as (chassis, thermometer):
            recorder = BlowRecorder(self.catalogue, self.run, set_number, thermometer)
            run_hammer_session(
                chassis,
                channels,
                step,
                self.operator,
                recorder,
                self.observer,
                self.control,
                self.completed.points_of(set_number),
            )

    def _sweep(self, step: SineStep, first_number: int) -> None:
        channels = channels_of(step, self.instruments)
        with (
            self.instruments.acquisition() as (chassis, thermometer),
            self.instruments.tester(self.observer) as tester,
            chassis.record(channels, step.sample_rate, LONGEST_RECORD) as recorder,
        ):
            run_sweep(
                sweep_plan(step, first_number),
                tester,
                recorder,
                thermometer,
                self.operator,
                SineRecorder(self.catalogue, self.run, self.completed.elapsed),
                self.observer,
                self.control,
                self.completed.sines,
            )


def _carry_out(work: _Work) -> None:
    """Carry out the remaining steps and store how the run ended."""
    try:
        work.control.begin()
        for step, number in work.completed.remaining_steps(work.sequence):
            work.do(step, number)
    except (KeyboardInterrupt, RunStoppedError):
        _end(work, RunState.STOPPED, "stopped by hand")
        raise
    except Exception as error:
        if not isinstance(error, EXPECTED):
            log.exception("run %s ended with an unexpected error", work.run.id)
        _end(work, RunState.FAILED, failure_reason(error, EXPECTED))
        raise
    _end(work, RunState.FINISHED)
    discard_run_lock(work.catalogue, work.run)


def _end(work: _Work, state: RunState, reason: str | None = None) -> None:
    work.catalogue.waveforms.finish(work.run.waveform_file)
    who = who_is_here()
    try:
        with work.catalogue.writing() as session:
            finish_run(session, work.run.id, state, reason, who=who)
    except StoreError as error:
        # the reason for the end matters more than that the catalogue cannot store it
        message = f"run {work.run.id} ended as {state} ({reason}), which could not be stored: {error}"
        try:
            defer_run_end(work.catalogue, work.run, state, reason, who)
        except StoreError as other:
            raise StoreError(f"{message}; nor kept: {other}") from error
        raise StoreError(message) from error


def _described(sequence: Sequence) -> dict[str, Any]:
    setup = sequence.article.model_dump(mode="json")
    if sequence.sweep is not None:
        setup["direct"] = {"file": "direct.csv", "preset_mm": sequence.sweep.preset_mm}
    return {
        "kind": KIND,
        "title": sequence.title,
        "article": sequence.article_name,
        "setup": setup,
        "sequence": sequence.model_dump(mode="json"),
    }


def _check_same(
    catalogue: Catalogue, run: Run, left: Sequence, instruments: Instruments, found: tuple[Instrument, ...]
) -> None:
    """Check that the instruments are those with which the run began.

    Raises ResumeError where a channel or an instrument is another.
    """
    with catalogue.reading() as session:
        channels = {channel.name: channel for channel in list_channels(session, run.id)}
        known = {(each.kind, each.serial) for each in list_instruments(session, run.id)}
    for name in sorted(channel_names(left.steps)):
        now = stored_channel(instruments.channels_named(name)[0])
        if now != channels.get(name):
            raise ResumeError(
                f"run {run.id} began with another setting or sensor on channel {name!r} than the table has now; "
                "connect what it began with, or begin a new run"
            )
    for each in found:
        if each.kind != "thermometer" and (each.kind, each.serial) not in known:
            raise ResumeError(
                f"run {run.id} did not begin with {each.kind} {each.serial}; connect the one it began with, or begin a "
                "new run"
            )


def reset_tester(
    instruments: Instruments, observer: Observer, note: Callable[[Interlock, str], None] = lambda *_: None
) -> Interlock:
    """Reset the tester if an interlock has fired; returns the interlocks that had.

    Args:
        instruments: of the rig.
        observer: gets the event.
        note: is called with these interlocks and the outcome, also where the tester refuses.

    Raises:
        TesterRefusedError: the cause is still there.
        RigError: the instrument does not answer.
    """
    with instruments.tester(observer) as tester:
        tripped = tester.status().interlocks
        if tripped:
            try:
                tester.reset()
            except RigError as error:
                note(tripped, str(error))
                raise
            note(tripped, "done")
    return tripped


def _reset(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, observer: Observer, target: str, who: str
) -> str | None:
    """Reset the tester if `sequence` needs it and it has tripped; the text for the history of the run, or None.

    The audit log has an entry even if the run does not begin.
    """

    def note(tripped: Interlock, outcome: str) -> None:
        details = {"interlocks": list(interlock_names(tripped))}
        with catalogue.writing() as session:
            add_audit_entry(
                session, who=who, action="acknowledge interlock", target=target, outcome=outcome, details=details
            )

    tripped = reset_tester(instruments, observer, note) if sequence.sine_steps else NO_INTERLOCK
    return f"tester reset after {interlock_text(tripped)}" if tripped else None
