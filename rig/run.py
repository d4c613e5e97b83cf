"""Running a sequence: its steps one after the other, each on the instruments that it needs, into one run."""

from __future__ import annotations

from analysis.blow_check import BlowLimits
from analysis.dof import Dof
from daq.channels import Channel
from daq.errors import ChannelError
from rig.hammer import HammerSettings, run_hammer_session
from rig.instruments import Instruments, stored_channel
from rig.operator import Observer, Operator, RunStarted, unobserved
from rig.recording import BlowRecorder, SineRecorder
from rig.registers import MAP_VERSION, State
from rig.sequence import DISPLACEMENT, FORCE, HammerStep, Sequence, SweepStep
from rig.sweep import SweepPlan, run_sweep
from rig.tester_limits import TesterLimits
from rig.tester_status import TesterTrippedError, names_of
from store.catalogue import Catalogue
from store.errors import StoreError
from store.instruments import Instrument
from store.runs import Run, RunState, finish_run, start_run

LONGEST_RECORD = 12.0  # s, the record that the sweep's task is made for; each one says how long it really is


def run_sequence(
    sequence: Sequence,
    instruments: Instruments,
    catalogue: Catalogue,
    operator: Operator,
    observer: Observer = unobserved,
) -> int:
    """Run every step of `sequence` and return the number of the run that holds what was measured.

    The plan and the instruments are looked at before a run is stored: where a step asks for too much or an instrument
    is absent, nothing is. A run that fails or is stopped keeps what was measured until then, and says why it ended.

    Raises:
        RigError, DaqError: a step asks for what cannot be, or an instrument is absent, refuses or fails.
        StoreError: the measurement cannot be stored.
    """
    check_plan(sequence, instruments.limits)
    identities = check_instruments(sequence, instruments)
    run = _start(sequence, instruments, catalogue, identities)
    observer(RunStarted(run.id))
    set_number = 0
    try:
        for step in sequence.steps:
            if isinstance(step, HammerStep):
                set_number += 1
                _hammer(step, set_number, run, instruments, catalogue, operator, observer)
            else:
                _sweep(step, run, instruments, catalogue, operator, observer)
    except KeyboardInterrupt:
        _end(catalogue, run, RunState.STOPPED, "stopped by hand")
        raise
    except Exception as error:
        _end(catalogue, run, RunState.FAILED, f"{type(error).__name__}: {error}")
        raise
    _end(catalogue, run, RunState.FINISHED)
    return run.id


def check_plan(sequence: Sequence, limits: TesterLimits) -> None:
    """Let `sequence` pass if every step of it can be asked for.

    Raises:
        HammerError, PlanError: a step makes no sense.
        LimitExceededError: the sweep is beyond `limits`.
    """
    for step in sequence.steps:
        if isinstance(step, HammerStep):
            hammer_settings(step)
        else:
            sweep_plan(step).check(limits)


def check_instruments(sequence: Sequence, instruments: Instruments) -> tuple[Instrument, ...]:
    """Connect to everything that `sequence` needs, move nothing, and say what is there.

    Raises:
        RigError, DaqError: an instrument does not answer or obey, or a channel is missing or does not fit.
    """
    found = []
    with instruments.acquisition() as (chassis, thermometer):
        for step in sequence.steps:
            chassis.verify(_channels(step, instruments))
        thermometer.celsius()
        found += [Instrument("acquisition", device.product_type, device.serial) for device in chassis.devices]
    found.append(Instrument("thermometer", "serial", instruments.thermometer_url))
    if sequence.sweep is not None:
        with instruments.tester() as tester:
            tester.stop()  # it is at rest: what counts is that it obeys
            if tester.state() is State.TRIPPED:
                raise TesterTrippedError(
                    f"{instruments.tester_url} is stopped by {names_of(tester.status().interlocks)}; see to the cause, "
                    "then reset",
                    tester.status().interlocks,
                )
            details = {"map_version": MAP_VERSION, "limits": dict(tester.identity.limits)}
            found.append(Instrument("tester", "elastomer tester", tester.identity.serial, details=details))
    return tuple(found)


def hammer_settings(step: HammerStep) -> HammerSettings:
    """The session that a hammer step asks for."""
    return HammerSettings(
        points=tuple(Dof.parse(point) for point in step.points),
        blows=step.blows,
        block_duration=step.block_seconds,
        sample_rate=step.sample_rate,
        pre_trigger=step.pretrigger_seconds,
        trigger_level=step.trigger_level,
        limits=BlowLimits(lowest_peak_force=step.weakest_peak, highest_frequency=step.highest_frequency),
        hammer=step.hammer,
    )


def sweep_plan(step: SweepStep) -> SweepPlan:
    """The plan that a sweep step asks for."""
    return SweepPlan(
        frequencies=step.frequencies.values,
        amplitudes_pp=tuple(amplitude * 1e-3 for amplitude in step.amplitudes_pp_mm),
        preset=step.preset_mm * 1e-3,
        configurations=step.configurations,
        specimens=step.specimens,
    )


def _start(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, identities: tuple[Instrument, ...]
) -> Run:
    names = {name for step in sequence.steps for name in _channel_names(step)}
    setup = sequence.article.model_dump(mode="json")
    if sequence.sweep is not None:
        setup["direct"] = {"file": "direct.csv", "preset_mm": sequence.sweep.preset_mm}
    with catalogue.writing() as session:
        return start_run(
            session,
            kind="sequence",
            title=sequence.title,
            article=sequence.article_name,
            setup=setup,
            sequence=sequence.model_dump(mode="json"),
            channels=[stored_channel(channel) for channel in instruments.channels if channel.name in names],
            instruments=identities,
        )


def _end(catalogue: Catalogue, run: Run, state: RunState, reason: str | None = None) -> None:
    catalogue.waveforms.finish(run.waveform_file)
    try:
        with catalogue.writing() as session:
            finish_run(session, run.id, state, reason)
    except StoreError as error:
        # what stopped the run matters more than that the catalogue cannot say so
        raise StoreError(f"run {run.id} ended as {state} ({reason}), which could not be stored: {error}") from error


def _hammer(
    step: HammerStep,
    set_number: int,
    run: Run,
    instruments: Instruments,
    catalogue: Catalogue,
    operator: Operator,
    observer: Observer,
) -> None:
    channels = _channels(step, instruments)
    with instruments.acquisition() as (chassis, thermometer):
        recorder = BlowRecorder(catalogue, run, set_number, thermometer)
        run_hammer_session(chassis, channels, hammer_settings(step), operator, recorder, observer)


def _sweep(
    step: SweepStep,
    run: Run,
    instruments: Instruments,
    catalogue: Catalogue,
    operator: Operator,
    observer: Observer,
) -> None:
    channels = _channels(step, instruments)
    with (
        instruments.acquisition() as (chassis, thermometer),
        instruments.tester() as tester,
        chassis.record(channels, step.sample_rate, LONGEST_RECORD) as recorder,
    ):
        sink = SineRecorder(catalogue, run)
        run_sweep(sweep_plan(step), tester, recorder, thermometer, operator, sink, observer)


def _channels(step: HammerStep | SweepStep, instruments: Instruments) -> tuple[Channel, ...]:
    """The channels of a step.

    Raises:
        ChannelError: one is missing, or measures something else.
    """
    channels = instruments.channels_named(*_channel_names(step))
    units = ("N", "m/s^2") if isinstance(step, HammerStep) else ("m", "N")
    for channel, unit in zip(channels, units, strict=True):
        if channel.unit != unit:
            raise ChannelError(
                f"channel {channel.name!r} on {channel.physical} measures {channel.unit}, but the {step.step} step "
                f"takes it for {unit}; correct the channel table, or name another channel"
            )
    return channels


def _channel_names(step: HammerStep | SweepStep) -> tuple[str, str]:
    if isinstance(step, HammerStep):
        return step.hammer, step.accelerometer
    return DISPLACEMENT, FORCE
