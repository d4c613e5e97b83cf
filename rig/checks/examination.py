"""Examining the rig: its instruments and channels at rest, and its sensors on a calibrator or a suspended mass.

Every check is done that can be: an instrument that fails is a failed check, and the others are examined all the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from analysis.chain import Calibrator, FoundSensitivity
from daq.block import Block
from daq.channels import Channel
from daq.errors import DaqError
from daq.instrument import DaqInstrument
from rig.checks.channel_checks import check_of_sensor, checks_at_rest, checks_on_calibrator, checks_on_mass
from rig.checks.check import Check, Place, failed, judged, not_done
from rig.checks.tester_checks import CONSENT, TRIPS, checks_of_tester, checks_of_trips
from rig.control import RunControl
from rig.errors import RequestError, RigError, RunStoppedError
from rig.events import ExaminationStep, Observer, ignore_event
from rig.instruments import NOT_DRIVEN, Instruments
from rig.sequences.sequence import DISPLACEMENT, FORCE
from rig.sequences.steps import tester_instrument
from rig.tester.stop_latch import LeaseLostError
from rig.thermometer import Thermometer
from store.instrument import Instrument

RATE = 5120.0  # Hz
ASK_ITS_OWN = f"{NOT_DRIVEN}: look at its own display, and try its stop and its watchdog by its own software"
STEADY_SECONDS, BLOW_SECONDS = 2.0, 5.0
"""Lengths of records: at rest and on a calibrator; and of blows on a mass, enough to strike two or three times."""


@dataclass(frozen=True)
class Examination:
    """The parts of the rig to examine.

    Attributes:
        place: where the sensors are.
        trip: whether watchdog and emergency stop may be tripped, with hydraulics on and the actuator at rest.
        hammer, accelerometer: names of their channels.
        calibrator: the one on which the accelerometer is mounted, at `Place.CALIBRATOR`.
        mass: kg, of the suspended mass that is struck, the accelerometer on it included; needed at `Place.MASS`.
    """

    place: Place = Place.BENCH
    trip: bool = False
    hammer: str = "hammer"
    accelerometer: str = "accelerometer"
    calibrator: Calibrator = field(default_factory=Calibrator)
    mass: float | None = None


@dataclass(frozen=True)
class Examined:
    """The findings of an examination.

    Attributes:
        checks: in the order in which they were done.
        instruments: those that answered, by kind and serial number.
        sensitivity: of the accelerometer, where it was on a calibrator and a tone was found; else None.
    """

    checks: tuple[Check, ...]
    instruments: tuple[Instrument, ...] = ()
    sensitivity: FoundSensitivity | None = None


def examine(
    instruments: Instruments, asked: Examination, observer: Observer = ignore_event, control: RunControl | None = None
) -> Examined:
    """Examine the rig.

    Args:
        instruments: of the rig; none is open yet.
        asked: what is to be examined.
        observer: gets an event for each step, and for trips of the tester.
        control: may stop the examination, with the actuator at rest.

    Raises:
        RequestError: a mass is to be struck and was not given.
        ChannelError: the channel table lacks a channel that was named.
        DaqError: the acquisition fails at `Place.CALIBRATOR` or `Place.MASS`; on the bench that is a failed check.
        RunStoppedError: STOP is in force, and something was to be tripped.
        LeaseLostError: another client has taken the rig meanwhile, and something was to be tripped.
    """
    match asked.place:
        case Place.BENCH:
            return _bench(instruments, asked.trip, observer, control or RunControl(instruments.latch))
        case Place.CALIBRATOR:
            return _calibrator(instruments, asked, observer)
        case Place.MASS:
            return _mass(instruments, asked, observer)


def _bench(instruments: Instruments, trip: bool, observer: Observer, control: RunControl) -> Examined:
    checks, found, means = list[Check](), list[Instrument](), dict[str, float]()
    observer(ExaminationStep("the acquisition device"))
    try:
        with instruments.daq() as chassis:
            found += [Instrument("acquisition", each.product_type, each.serial) for each in chassis.devices]
            names = ", ".join(f"{each.product_type} {each.serial}" for each in chassis.devices)
            checks.append(judged("identity", "acquisition", True, "", names))
            for channels in _by_module(chassis, instruments.channels, checks):
                observer(ExaminationStep(", ".join(channel.name for channel in channels)))
                checks += _sensors(chassis, channels, instruments.channels)
                checks += _at_rest(chassis, channels, means)
    except DaqError as error:
        checks.append(failed("identity", "acquisition", error))
    observer(ExaminationStep("the thermometer"))
    try:
        with Thermometer(instruments.thermometer_url) as thermometer:
            checks.append(judged("reading", "thermometer", True, "", thermometer.celsius(), unit="degC"))
            found.append(Instrument("thermometer", "serial", instruments.thermometer_url))
    except RigError as error:
        checks.append(failed("reading", "thermometer", error))
    if instruments.driven_url is not None:
        checks += _tester(instruments, trip, means, observer, control, found)
    elif instruments.is_external:
        checks += [not_done(each, "tester", ASK_ITS_OWN) for each in ("identity", "interlocks", *TRIPS)]
    return Examined(tuple(checks), tuple(found))


def _by_module(chassis: DaqInstrument, channels: Sequence[Channel], checks: list[Check]) -> list[tuple[Channel, ...]]:
    """The channels that fit the chassis, module by module; those that it lacks or refuses are failed checks."""
    modules = dict[str, list[Channel]]()
    for channel in channels:
        try:
            chassis.verify([channel])
            modules.setdefault(chassis.device_of(channel).name, []).append(channel)
        except DaqError as error:
            checks.append(failed("input", channel.name, error))
    return [tuple(each) for each in modules.values()]


def _sensors(chassis: DaqInstrument, channels: tuple[Channel, ...], table: Sequence[Channel]) -> list[Check]:
    """A check of each sensor of a module that has a data sheet of its own."""
    checks = list[Check]()
    for channel in channels:
        try:
            teds = chassis.teds(channel)
        except DaqError as error:
            checks.append(failed("sensor", channel.name, error))
        else:
            checks += [] if teds is None else [check_of_sensor(teds, channel, table)]
    return checks


def _at_rest(chassis: DaqInstrument, channels: tuple[Channel, ...], means: dict[str, float]) -> list[Check]:
    """The checks of the channels of a module; notes the means of the tester's channels."""
    try:
        block = _record(chassis, channels, STEADY_SECONDS)
    except DaqError as error:
        return [failed("input", channel.name, error) for channel in channels]
    for channel in channels:
        if channel.name in (DISPLACEMENT, FORCE) and channel.name not in block.overloaded:
            means[channel.name] = float(np.mean(block.value(channel.name)))
    return [check for channel in channels for check in checks_at_rest(block, channel)]


def _record(chassis: DaqInstrument, channels: Sequence[Channel], duration: float) -> Block:
    with chassis.record(channels, RATE, duration) as recorder:
        return recorder.record()


def _tester(
    instruments: Instruments,
    trip: bool,
    means: dict[str, float],
    observer: Observer,
    control: RunControl,
    found: list[Instrument],
) -> list[Check]:
    checks = list[Check]()
    observer(ExaminationStep("the tester"))
    try:
        with instruments.tester(observer) as tester, control.driving(tester):
            found.append(tester_instrument(tester.identity))
            checks += checks_of_tester(tester, means, {each.name: each for each in instruments.channels})
            if trip:
                observer(ExaminationStep("watchdog and emergency stop of the tester, with hydraulics on"))
                # the channels took their time: the right to drive is checked again where hydraulics are switched on
                checks += checks_of_trips(tester, control.begin)
            else:
                checks += [not_done(each, "tester", CONSENT) for each in TRIPS]
    except (RunStoppedError, LeaseLostError):
        raise
    except RigError as error:
        checks.append(failed("tester" if checks else "identity", "tester", error))
    return checks


def _calibrator(instruments: Instruments, asked: Examination, observer: Observer) -> Examined:
    channels = instruments.channels_named(asked.hammer, asked.accelerometer)
    observer(ExaminationStep(f"{asked.accelerometer} on the calibrator"))
    with instruments.daq() as chassis:
        block = _record(chassis, channels, STEADY_SECONDS)
    checks, sensitivity = checks_on_calibrator(block, channels[1], asked.calibrator)
    return Examined(tuple(checks), sensitivity=sensitivity)


def _mass(instruments: Instruments, asked: Examination, observer: Observer) -> Examined:
    if asked.mass is None:
        raise RequestError("the mass that hangs was not given; weigh it with the accelerometer on it")
    channels = instruments.channels_named(asked.hammer, asked.accelerometer)
    observer(ExaminationStep(f"{asked.hammer} and {asked.accelerometer}: strike the mass now, for {BLOW_SECONDS:g} s"))
    with instruments.daq() as chassis:
        block = _record(chassis, channels, BLOW_SECONDS)
    return Examined(tuple(checks_on_mass(block, channels[0], channels[1], asked.mass)))
