"""Plans and channels of the steps of a sequence, and their checks before anything moves."""

from dataclasses import replace

from daq.channels import Channel
from daq.errors import ChannelError, DaqError
from rig.errors import RigError
from rig.events import Observer, ignore_event
from rig.instruments import EXTERNAL, NO_TESTER, NOT_DRIVEN, Instruments
from rig.registers import name_of
from rig.sequences.sequence import DISPLACEMENT, FORCE, BlankStep, HammerStep, Sequence, SineStep, Step
from rig.sequences.sweep_plan import SweepPlan
from rig.tester.detectors import check_tighter
from rig.tester.limits import TesterLimits
from rig.tester.missing_functions import unaccepted
from rig.tester.monitor import poll_tester
from rig.tester.rest_judge import POWERLESS
from rig.tester.status import TesterIdentity, TesterMismatchError, TesterTrippedError, state_text, stopping_text
from rig.thermometer import Thermometer
from store.instrument import Instrument
from store.states import BLANK


def check_plan(sequence: Sequence, limits: TesterLimits) -> None:
    """Check that every step of `sequence` can be carried out within `limits`.

    Raises PlanError where a step makes no sense, LimitExceededError where a sine step or a detector that it sets is
    beyond `limits`.
    """
    for step, _ in sequence.sine_steps:
        sweep_plan(step).check(limits)


def check_channels(sequence: Sequence, instruments: Instruments) -> None:
    """Check that the channel table has what every step of `sequence` records. Raises ChannelError as `channels_of`."""
    for step in sequence.steps:
        if isinstance(step, HammerStep | SineStep):
            channels_of(step, instruments)


def check_instruments(
    sequence: Sequence, instruments: Instruments, observer: Observer = ignore_event
) -> tuple[Instrument, ...]:
    """Connect the instruments that `sequence` needs, and identify them; nothing moves. `observer` hears of trips.

    Raises RigError, DaqError where an instrument does not answer or obey, or a channel is missing or does not fit.
    """
    found = []
    with instruments.acquisition() as (chassis, thermometer):
        for step in sequence.steps:
            if isinstance(step, HammerStep | SineStep):
                chassis.verify(channels_of(step, instruments))
        thermometer.celsius()
        found += [Instrument("acquisition", device.product_type, device.serial) for device in chassis.devices]
    found.append(Instrument("thermometer", "serial", instruments.thermometer_url))
    if sequence.sine_steps and instruments.is_external:
        _check_external(sequence)
        found.append(Instrument("tester", "driven by its own software", EXTERNAL))
    elif sequence.sine_steps:
        with instruments.tester(observer) as tester:
            for step, _ in sequence.sine_steps:
                check_tighter(sweep_plan(step).detectors, tester.identity.detectors)
            before = tester.status().state
            tester.stop()  # it is at rest already; this shows that it obeys
            status = tester.status()
            if before in POWERLESS and status.state not in POWERLESS:
                raise TesterMismatchError(
                    f"a hold switched the hydraulics of the tester on ({state_text(status.state)}), which were shut "
                    f"down: correct hold in {instruments.tester_map.name}"
                )
            tester.check_obeys()
            if status.is_stopped:
                why = f"the tester is stopped by {stopping_text(status.stopped_by)}; remove the cause, then reset"
                raise TesterTrippedError(why, status.interlocks)
            found.append(tester_instrument(tester.identity))
    return tuple(found)


def shortcomings(sequence: Sequence, instruments: Instruments) -> list[DaqError | RigError]:
    """Why `sequence` could not begin now; empty where nothing is seen that would keep it from that.

    Channels are verified, thermometer and status of the tester are read once; nothing is commanded, also while another
    program drives.
    """
    found = list[DaqError | RigError]()
    steps = [step for step in sequence.steps if isinstance(step, HammerStep | SineStep)]
    tables = list[tuple[Channel, ...]]()
    for step in steps:
        try:
            tables.append(channels_of(step, instruments))
        except ChannelError as error:
            found.append(error)
    try:
        with instruments.daq() as chassis:
            for table in tables:
                chassis.verify(table)
    except DaqError as error:
        found.append(error)
    try:
        with Thermometer(instruments.thermometer_url) as thermometer:
            thermometer.celsius()
    except RigError as error:
        found.append(error)
    if sequence.sine_steps:
        try:
            _check_tester(sequence, instruments)
        except RigError as error:
            found.append(error)
    return found


def _check_tester(sequence: Sequence, instruments: Instruments) -> None:
    if instruments.is_external:
        _check_external(sequence)
        return
    if instruments.tester_url is None:
        raise RigError(NO_TESTER)
    if why := unaccepted(instruments.tester_map.lacks, instruments.tester_without):
        raise TesterMismatchError(f"{instruments.tester_map.name} has {why}")
    status = poll_tester(instruments.tester_url, instruments.tester_map)
    if status.is_stopped:
        raise RigError(f"the tester is stopped by {stopping_text(status.stopped_by)}; remove the cause, then reset")


def _check_external(sequence: Sequence) -> None:
    """Check that `sequence` asks nothing of a tester that is not driven from here."""
    if any(step.detectors for step, _ in sequence.sine_steps):
        raise RigError(
            f"detectors are tightened in the sequence, and {NOT_DRIVEN}; set them there, leave them out here"
        )


def tester_instrument(identity: TesterIdentity) -> Instrument:
    """The tester as the catalogue stores it: its limits, and limit and action of each detector."""
    details = {
        "map": identity.map_name,
        "lacks": sorted(identity.lacks),
        "watchdog_time": identity.watchdog_time,
        "limits": dict(identity.limits),
        "detectors": {
            name_of(interlock): {"limit": detector.limit, "action": detector.action.name.lower()}
            for interlock, detector in identity.detectors.items()
        },
    }
    return Instrument("tester", "elastomer tester", identity.serial, details=details)


def sweep_plan(step: SineStep, first_number: int = 1) -> SweepPlan:
    """The plan of a sweep or blank step; seed 0 stands for one that is drawn when a run begins."""
    common = SweepPlan(
        frequencies=step.frequencies.values,
        preset=step.preset_mm * 1e-3,
        mains_frequency=step.mains_frequency,
        first_number=first_number,
        detectors={} if step.detectors is None else step.detectors.in_si(),
    )
    if isinstance(step, BlankStep):
        amplitudes_pp = (step.amplitude_pp_mm * 1e-3,)
        return replace(common, amplitudes_pp=amplitudes_pp, configurations=(BLANK,), specimens=(step.piece,))
    return replace(
        common,
        amplitudes_pp=tuple(amplitude * 1e-3 for amplitude in step.amplitudes_pp_mm),
        configurations=step.configurations,
        specimens=step.specimens,
        order=step.order,
        seed=step.seed or 0,
    )


def channels_of(step: HammerStep | SineStep, instruments: Instruments) -> tuple[Channel, ...]:
    """The channels of a step.

    Raises ChannelError where one is missing, measures something else, or ends below the blows that are asked for.
    """
    channels = instruments.channels_named(*_channel_names(step))
    units = ("N", "m/s^2") if isinstance(step, HammerStep) else ("m", "N")
    for channel, unit in zip(channels, units, strict=True):
        if channel.unit != unit:
            raise ChannelError(
                f"channel {channel.name!r} on {channel.physical} measures {channel.unit}, but the {step.step} step "
                f"takes it for {unit}; correct the channel table, or name another channel"
            )
    if isinstance(step, HammerStep) and step.peak_force > channels[0].maximum:  # a push is positive, whatever polarity
        raise ChannelError(
            f"channel {step.hammer!r} ends at {channels[0].maximum:g} N, below the peak_force {step.peak_force:g} N of "
            "the hammer step, so that its blows would be overloads: strike more softly, or correct the range in the "
            "channel table"
        )
    return channels


def channel_names(steps: tuple[Step, ...]) -> set[str]:
    """Names of all channels that `steps` record."""
    return {name for step in steps if isinstance(step, HammerStep | SineStep) for name in _channel_names(step)}


def _channel_names(step: HammerStep | SineStep) -> tuple[str, str]:
    if isinstance(step, HammerStep):
        return step.hammer, step.accelerometer
    return DISPLACEMENT, FORCE
