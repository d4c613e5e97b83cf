"""Carrying out a run: the steps of its sequence one after the other, each on the instruments that it needs.

What is measured goes to the records of the run (`rig/runs/records.py`); this module knows no catalogue.
"""

import logging
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, fields, replace
from datetime import UTC, datetime

from analysis.errors import AnalysisError
from daq.errors import DaqError
from rig.control import RunControl
from rig.errors import RigError, RunStoppedError, failure_reason, with_notes
from rig.events import Event, HammerStarted, Observer, PromptStarted, RunContinued, RunStarted, ignore_event
from rig.hammer.session import run_hammer_session
from rig.instruments import Instruments, stored_channel
from rig.operator import BEAM, Operator
from rig.registers import Interlock, interlock_names
from rig.runs.completed_points import ResumeError
from rig.runs.recorder import BlowRecorder, SineRecorder
from rig.runs.records import BeginRecord, BegunWith, EndRecord, ResetRecord, RunOrder, RunRecords
from rig.runs.waiting import soak, wait
from rig.sequences.sequence import (
    BlankStep,
    HammerStep,
    PromptStep,
    Sequence,
    SineStep,
    SoakStep,
    Step,
    SweepStep,
    WaitStep,
)
from rig.sequences.steps import channel_names, channels_of, check_instruments, check_plan, sweep_plan
from rig.sweep.driven_sweep import run_sweep
from rig.sweep.external_sweep import run_external_sweep
from rig.tester.status import stopping_text
from store.errors import StoreError
from store.instrument import Instrument, StoredChannel
from store.provenance import who_is_here
from store.states import RunState

EXPECTED = (RigError, DaqError, StoreError, AnalysisError)
LONGEST_RECORD = 12.0  # s, the record that the sweep's task is made for; each record has a length of its own
log = logging.getLogger(__name__)


def carry_out(
    order: RunOrder,
    instruments: Instruments,
    operator: Operator,
    records: RunRecords,
    observer: Observer = ignore_event,
    control: RunControl | None = None,
) -> str | None:
    """Carry out every step of `order` that is not complete; returns what the operator left out, None if nothing.

    The plan and the instruments are checked before the run begins: if a step exceeds a limit or an instrument is
    absent, at most the record of a reset is written. A run that fails or is stopped keeps what was measured and the
    reason, and can be resumed.

    Args:
        instruments: of the rig; for a run that goes on, those that it began with.
        control: may pause and stop the run.

    Raises:
        RunStoppedError: `control` asked for it.
        ResumeError: other instruments are connected than the run began with; nothing moved.
        RigError, DaqError: a step is impossible, or an instrument is absent, refuses or fails.
        StoreError: a record cannot be written.
    """
    control = control or RunControl(instruments.latch)
    check_plan(order.sequence, instruments.limits)
    steps = order.completed.remaining_steps(order.sequence)
    left = order.sequence.model_copy(update={"steps": tuple(step for step, _ in steps)})
    reset_done = _reset(order, left, instruments, records, observer) if order.reset else None
    found = check_instruments(left, instruments, observer) if steps else ()
    begun = order.begun_with
    if begun is not None:
        _check_same(order.run_id, begun, left, instruments, found)
    control.carry_out(lambda: None, observer)  # a stop before this line stores nothing
    control.begin()
    begin = _begin(order, instruments, found, reset_done)
    records.write(begin)
    started_at = begin.at if begun is None else begun.started_at
    work = _Work(order, started_at, instruments, records, operator, observer, control)
    try:
        observer(_begun_event(order))
        control.begin()
        left_out = [points for step, number in steps for points in work.do(step, number)]
    except (KeyboardInterrupt, RunStoppedError) as stop:
        why = control.automatic_stop_reason
        # where nobody says who asked, this process is known at least
        who = control.stopped_by or who_is_here() if why is None else None
        noted = with_notes(why or "stopped by hand", stop)
        _end(order, records, RunState.STOPPED, noted, who=who, by_itself=why is not None)
        raise
    except Exception as error:
        if not isinstance(error, EXPECTED):
            log.exception("run %s ended with an unexpected error", order.run_id)
        _end(order, records, RunState.FAILED, failure_reason(error, EXPECTED), by_itself=True)
        raise
    reason = f"left out, as the operator ended the mounting: {'; '.join(left_out)}" if left_out else None
    _end(order, records, RunState.FINISHED, reason)
    return reason


@dataclass(frozen=True)
class _Work:
    """The steps of one run."""

    order: RunOrder
    started_at: datetime
    instruments: Instruments
    records: RunRecords
    operator: Operator
    observer: Observer
    control: RunControl

    def do(self, step: Step, number: int) -> tuple[str, ...]:
        """Carry out what is left of a step; returns what the operator left out of it."""
        match step:
            case HammerStep():
                self._hammer(step, number)
            case SweepStep() | BlankStep():
                return self._sweep(step, number)
            case _:
                needs_tester = bool(self.order.sequence.sine_steps)
                with self.instruments.unused() if needs_tester else nullcontext():
                    self._wait(step)
        return ()

    def _wait(self, step: SoakStep | PromptStep | WaitStep) -> None:
        match step:
            case SoakStep():
                with self.instruments.acquisition() as (_, thermometer):
                    soak(step, thermometer, self.observer, self.control)
            case PromptStep():
                self.observer(PromptStarted(step.text))
                self.control.carry_out(lambda: self.operator.do_task(step.text), self.observer)
            case WaitStep():
                wait(step.seconds, self.observer, self.control)

    def _hammer(self, step: HammerStep, set_number: int) -> None:
        channels = channels_of(step, self.instruments)
        if self.order.sequence.hangs_beam:
            self.operator.mount(BEAM, step.beam)
        self.observer(HammerStarted(set_number, step.peak_force))
        with self.instruments.acquisition() as (chassis, thermometer):
            recorder = BlowRecorder(self.records, set_number, thermometer, self.control)
            run_hammer_session(
                chassis,
                channels,
                step,
                self.operator,
                recorder,
                self.observer,
                self.control,
                self.order.completed.points_of(set_number, step),
            )

    def _sweep(self, step: SineStep, first_number: int) -> tuple[str, ...]:
        channels, plan = channels_of(step, self.instruments), sweep_plan(step, first_number)
        completed = self.order.completed
        sink = SineRecorder(self.records, self.started_at, completed.elapsed)
        driven = nullcontext(None) if self.instruments.is_external else self.instruments.tester(self.observer)
        with (
            self.instruments.acquisition() as (chassis, thermometer),
            driven as tester,
            chassis.record(channels, step.sample_rate, LONGEST_RECORD) as recorder,
        ):
            if tester is None:
                return run_external_sweep(
                    plan, recorder, thermometer, self.operator, sink, self.observer, self.control, completed.sines,
                    self.instruments.external_patience,
                )  # fmt: skip
            run_sweep(
                plan, tester, recorder, thermometer, self.operator, sink, self.observer, self.control, completed.sines
            )
            return ()


def _begin(
    order: RunOrder, instruments: Instruments, found: tuple[Instrument, ...], reset_done: str | None
) -> BeginRecord:
    if order.begun_with is None:
        named = channel_names(order.sequence.steps)
        channels = tuple(stored_channel(channel) for channel in instruments.channels if channel.name in named)
        return BeginRecord(datetime.now(UTC), order.who, channels, found, reset_done)
    reasons = filter(None, (order.begun_with.reason, reset_done))
    return BeginRecord(datetime.now(UTC), order.who, (), (), ", ".join(reasons))


def _begun_event(order: RunOrder) -> Event:
    if order.begun_with is None:
        return RunStarted(order.run_id)
    return RunContinued(order.run_id, order.completed.blows, len(order.completed.sines))


def _end(
    order: RunOrder,
    records: RunRecords,
    state: RunState,
    reason: str | None = None,
    *,
    who: str | None = None,
    by_itself: bool = False,
) -> None:
    try:
        records.write(EndRecord(datetime.now(UTC), who, state, reason, by_itself))
    except StoreError as error:
        # the reason for the end matters more than that it cannot be stored
        message = f"run {order.run_id} ended as {state} ({reason}), which could not be stored: {error}"
        raise StoreError(message) from error


def _check_same(
    run_id: int, begun: BegunWith, left: Sequence, instruments: Instruments, found: tuple[Instrument, ...]
) -> None:
    """Check that the instruments are those with which the run began.

    Raises ResumeError where a channel or an instrument is another.
    """
    channels = {channel.name: channel for channel in begun.channels}
    known = {(each.kind, each.serial) for each in begun.instruments}
    for name in sorted(channel_names(left.steps)):
        now = stored_channel(instruments.channels_named(name)[0])
        if name not in channels:
            raise ResumeError(f"run {run_id} began without channel {name!r}; begin a new run")
        if changes := _changes(channels[name], now):
            raise ResumeError(
                f"channel {name!r} has changed since run {run_id} began: {changes}. Restore its setting and sensor, or "
                "begin a new run"
            )
    for each in found:
        if each.kind != "thermometer" and (each.kind, each.serial) not in known:
            raise ResumeError(
                f"run {run_id} did not begin with {each.kind} {each.serial}; connect the one it began with, or begin a "
                "new run"
            )


def _changes(began: StoredChannel, now: StoredChannel) -> str:
    """What differs of a channel, in words; empty where nothing does."""
    if began.polarity is None:  # a version that did not store it
        began = replace(began, polarity=now.polarity)
    settings = [each.name for each in fields(StoredChannel) if each.name != "instrument"]
    of_sensor = [each.name for each in fields(Instrument) if each.compare]
    values = [(name, getattr(began, name), getattr(now, name)) for name in settings]
    values += [(name, getattr(began.instrument, name), getattr(now.instrument, name)) for name in of_sensor]
    changes = [f"{name.replace('_', ' ')} {before}, now {after}" for name, before, after in values if before != after]
    return ", ".join(dict.fromkeys(changes))  # the sensitivity is one of both


def reset_tester(
    instruments: Instruments, observer: Observer, note: Callable[[Interlock, str], None] = lambda *_: None
) -> Interlock:
    """Reset the tester if an interlock has fired; returns the interlocks that had.

    Args:
        note: is called with these interlocks and the outcome, also where the tester refuses.

    Raises:
        TesterRefusedError: the cause is still there.
        RigError: the instrument does not answer.
    """
    with instruments.tester(observer) as tester:
        status = tester.status()
        tripped = status.interlocks
        if tripped or status.is_stopped:
            try:
                tester.reset()
            except RigError as error:
                note(tripped, str(error))
                raise
            note(tripped, "done")
    return tripped


def _reset(
    order: RunOrder, left: Sequence, instruments: Instruments, records: RunRecords, observer: Observer
) -> str | None:
    """Reset the tester if `left` needs it and it has tripped; the text for the history of the run, or None.

    A record says so even if the run does not begin.
    """

    done = list[str]()

    def note(tripped: Interlock, outcome: str) -> None:
        records.write(ResetRecord(datetime.now(UTC), order.who, interlock_names(tripped), outcome))
        done.append(f"tester reset after {stopping_text(tripped)}")

    if left.sine_steps:
        reset_tester(instruments, observer, note)
    return done[-1] if done else None
