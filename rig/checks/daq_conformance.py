"""Whether an acquisition instrument behaves as this program needs: checks that its maker can run, too.

Nothing has to be connected. A known voltage or tone on the first channel lets its unit and lost samples be checked.
"""

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from analysis.direct.sine import fit_sine
from analysis.errors import AnalysisError
from daq.block import Block
from daq.channels import HAMMERS, LARGEST_INPUT, Channel, ChannelKind
from daq.errors import AcquisitionCancelledError, DaqError, TriggerTimeoutError
from daq.instrument import DaqInstrument, EdgeTrigger
from rig.checks.check import Check, failed, judged, not_done

SUBJECT = "acquisition"
FIRST = "input_1"  # of channels that are no sensors
RATE = 5120.0  # Hz
SHORT, LONG = 0.1, 1.1  # s
RATE_WITHIN = 0.05
"""Largest relative difference of the rate, by the clock of this computer, from the stated one; the clock and the waits
of this computer alone make 0.02."""
MOST_RECORDS = 12
"""Records at most. The rate follows from the shortest times. Three records are taken at first, more only where these do
not show the stated rate."""
CLOCK_WITHIN = 0.1  # s by which the time of a record may be wrong
PROMPT = 1.0  # s that a record, a refusal or a cancellation may take beyond its time
MOST_RESIDUAL = 0.05
"""Largest rms beside a tone, over its amplitude: one lost sample in a hundred periods leaves more."""
TONE_WITHIN, VOLTS_WITHIN = 1e-3, 0.02
"""Largest relative difference of the frequency of a tone, and of a voltage, from the stated one."""
Open = Callable[[], DaqInstrument]


def first_inputs(instrument: DaqInstrument, volts: float) -> tuple[Channel, ...]:
    """Voltage channels of the first two inputs of the first device that has any, for `volts` V either way."""
    device = next((each for each in instrument.devices if each.inputs), None)
    inputs = device.inputs[:2] if device is not None else ()
    return tuple(
        Channel(f"input_{number}", physical, ChannelKind.VOLTAGE, 1.0, "m", -volts, volts)
        for number, physical in enumerate(inputs, 1)
    )


def check_daq(
    open_instrument: Open,
    channels: Sequence[Channel] = (),
    *,
    volts: float | None = None,
    tone: float | None = None,
    largest: float = 1.0,
) -> tuple[Check, ...]:
    """Run every check. A failed one does not end the others, unless no instrument can be opened or it has no input.

    Args:
        open_instrument: connects; called several times.
        channels: those on the same device as the first one are recorded; none given: `first_inputs`.
        volts: constant voltage at the first input, V; None where it is not known.
        tone: frequency of a sine at the first input, Hz; None where it is not known.
        largest: range that is asked for where no `channels` are given, V either way.
    """
    try:
        with open_instrument() as instrument:
            devices = instrument.devices
            module = instrument.device_of(channels[0]) if channels else None
            channels = tuple(each for each in channels if module and each.physical in module.inputs)
            channels = channels or first_inputs(instrument, largest)
    except DaqError as error:
        return (failed("identity", SUBJECT, error),)
    named = bool(channels) and all(each.name and each.serial for each in devices)
    what = ", ".join(f"{each.product_type} {each.serial}" for each in devices)
    advice = "a device needs a name, a serial number and inputs: calibrations and records refer to them"
    checks = [judged("identity", SUBJECT, named, advice, what)]
    if not channels:
        return tuple(checks)

    def check(id_: str, run: Callable[[DaqInstrument], list[Check]]) -> None:
        try:
            with open_instrument() as instrument:
                checks.extend(run(instrument))
        except (DaqError, AnalysisError) as error:
            checks.append(failed(id_, SUBJECT, error))

    check("refusals", lambda instrument: _refusals(instrument, channels))
    check("record", lambda instrument: _records(instrument, channels))
    check("input", lambda instrument: _ranges(instrument, channels))
    check("trigger", lambda instrument: _no_trigger(instrument, channels))
    check("cancel", lambda instrument: _cancelled(instrument, channels))
    check("volts", lambda instrument: [_volts(instrument, channels, volts)])
    check("sine", lambda instrument: _tone(instrument, channels, tone))
    check("reconnect", lambda instrument: [_reconnect(open_instrument, instrument.devices == devices, channels)])
    return tuple(checks)


def _refusals(instrument: DaqInstrument, channels: Sequence[Channel]) -> list[Check]:
    channel = channels[0]
    absent = replace(channel, physical=channel.physical.partition("/")[0] + "/no_such_input")
    largest, unit = LARGEST_INPUT[channel.kind.input_unit], channel.kind.input_unit
    most = largest / channel.sensitivity
    wide = replace(channel, minimum=-most, maximum=most)
    found = []
    for what, table in (("an input that it does not have", [absent]), (f"{largest:g} {unit}", [wide])):
        refused, began = "", time.monotonic()
        try:
            instrument.verify(table)
        except DaqError as error:
            refused = str(error)
        prompt = time.monotonic() - began <= PROMPT
        advice = f"{what} was accepted, or refused later than {PROMPT:g} s: raise ChannelError for it at once"
        found.append(judged("refusals", SUBJECT, bool(refused) and prompt, advice, f"{what}: {refused or 'accepted'}"))
    return found


def _records(instrument: DaqInstrument, channels: Sequence[Channel]) -> list[Check]:
    taken, asked, blocks, right_time = dict[float, float](), list[float](), list[Block](), 0.0
    with instrument.record(channels, RATE, SHORT) as recorder:
        recorder.record()
        rate, measured = recorder.sample_rate, 0.0
        # a computer with other work makes a record late, and never early: more records tell it from a wrong rate
        while abs(measured / rate - 1) > RATE_WITHIN and len(asked) < MOST_RECORDS:
            for duration in (SHORT, LONG, SHORT):
                began, clock = time.monotonic(), datetime.now(UTC)
                block = recorder.record(duration)
                took = time.monotonic() - began
                taken[duration] = min(took, taken.get(duration, took))
                late = (block.started_at - clock).total_seconds()
                right_time = max(right_time, abs(late) if late < 0 else max(0.0, late - (took - duration)))
                asked.append(duration)
                blocks.append(block)
            measured = (blocks[1].samples - blocks[0].samples) / (taken[LONG] - taken[SHORT])
    lengths = [each.counts.shape for each in blocks]
    wanted = [(len(channels), round(duration * rate)) for duration in asked]
    return [
        judged(
            "record", SUBJECT, lengths == wanted and all(each.sample_rate == rate for each in blocks),
            "a record needs all channels, as many samples as were asked for, and the rate of its task",
            str(lengths), str(wanted),
        ),
        judged(
            "rate", SUBJECT, abs(measured / rate - 1) <= RATE_WITHIN,
            "samples come at another rate than is stated: state the true one; where it is lower, samples are dropped",
            measured, rate, "Hz",
        ),
        judged(
            "reply", SUBJECT, taken[SHORT] - SHORT <= PROMPT, "a record takes too long beyond its own time",
            taken[SHORT] - SHORT, PROMPT, "s",
        ),
        judged(
            "timestamps", SUBJECT, right_time <= CLOCK_WITHIN,
            "a record says that it began when it did not: is the clock read, and are old samples dropped at a start?",
            right_time, CLOCK_WITHIN, "s",
        ),
    ]  # fmt: skip


def _ranges(instrument: DaqInstrument, channels: Sequence[Channel]) -> list[Check]:
    found = []
    with instrument.record(channels, RATE, SHORT) as recorder:
        block = recorder.record()
        for row, channel in enumerate(channels):
            low, high = recorder.input_range(channel.name)
            asked = channel.minimum * channel.sensitivity, channel.maximum * channel.sensitivity
            unit = channel.kind.input_unit
            step = abs(block.scaling[row][1])
            values = block.at_input(channel.name)
            inside = bool(np.all(np.isfinite(values)) and values.min() >= 1.1 * low and values.max() <= 1.1 * high)
            good = low <= 0.999 * asked[0] and high >= 0.999 * asked[1] and 0 < step < (high - low) / 256 and inside
            found.append(
                judged(
                    "input", channel.name, good,
                    f"the range of an input in {unit} has to hold what was asked for, a count has to be less than a "
                    f"256th of it, and every value inside: are scaling and range in {unit}?",
                    f"{low:g} to {high:g} {unit}, {step:g} {unit} a count", f"{asked[0]:g} to {asked[1]:g} {unit}",
                )
            )  # fmt: skip
    return found


def _source(channels: Sequence[Channel]) -> Channel | None:
    """The hammer's channel, or else the first of `first_inputs`; None where there is neither."""
    hammer = next((each for each in channels if each.kind in HAMMERS), None)
    return channels[0] if hammer is None and channels[0].name == FIRST else hammer


def _no_trigger(instrument: DaqInstrument, channels: Sequence[Channel]) -> list[Check]:
    source = _source(channels)
    if source is None:
        return [not_done("trigger", SUBJECT, "none of these channels is a hammer")]
    trigger = EdgeTrigger(source.name, 0.95 * source.maximum, 0.02)
    with instrument.triggered(channels, RATE, SHORT, trigger) as task:
        task.arm()
        began = time.monotonic()
        with suppress(TriggerTimeoutError):
            task.wait(0.2)
            return [not_done("trigger", SUBJECT, f"{source.name} passes 95 % of its range by itself")]
        took = time.monotonic() - began
        task.arm()
    advice = "without a trigger a task has to end in time, and be armed again"
    return [judged("trigger", SUBJECT, took <= 0.2 + SHORT + PROMPT, advice, took, 0.2 + SHORT + PROMPT, "s")]


def _cancelled(instrument: DaqInstrument, channels: Sequence[Channel]) -> list[Check]:
    with instrument.record(channels, RATE, 30.0) as recorder:
        began = time.monotonic()
        with suppress(AcquisitionCancelledError):
            recorder.record(cancelled=lambda: time.monotonic() > began + SHORT)
        took = time.monotonic() - began
        again = recorder.record(SHORT)
    good = took <= SHORT + PROMPT and again.samples == round(SHORT * recorder.sample_rate)
    return [judged("cancel", SUBJECT, good, "STOP waits for the record: let it end at once", took, SHORT + PROMPT, "s")]


def _volts(instrument: DaqInstrument, channels: Sequence[Channel], volts: float | None) -> Check:
    name = channels[0].name
    if volts is None:
        return not_done("volts", name, "connect a known voltage and say which (--volts)")
    with instrument.record(channels[:1], RATE, SHORT) as recorder:
        found = float(np.mean(recorder.record().at_input(name)))
    good = abs(found - volts) <= VOLTS_WITHIN * abs(volts)
    return judged("volts", name, good, "scaling has to make V of counts, with the right sign", found, volts, "V")


def _tone(instrument: DaqInstrument, channels: Sequence[Channel], tone: float | None) -> list[Check]:
    name = channels[0].name
    if tone is None:
        return [not_done("sine", name, "connect a sine and say its frequency (--tone), so that lost samples show")]
    with instrument.record(channels[:1], RATE, LONG) as recorder:
        block = recorder.record()
    value = block.value(name) - np.mean(block.value(name))
    fit = fit_sine(value, block.sample_rate, tone)
    left = float(2 * np.std(fit.residual[0]) / max(fit.amplitude_pp[0], 1e-300))
    checks = [
        judged(
            "sine", name, left <= MOST_RESIDUAL and abs(fit.frequency / tone - 1) <= TONE_WITHIN,
            f"the record is no sine of {tone:g} Hz: samples are lost or doubled, or the rate is not the stated one",
            f"{fit.frequency:.6g} Hz, {100 * left:.2g} % beside it", f"{tone:g} Hz, {100 * MOST_RESIDUAL:g} %",
        )
    ]  # fmt: skip
    if _source(channels) is not channels[0]:
        return [*checks, not_done("trigger_index", name, "it is no hammer")]
    level = float(fit.amplitude_pp[0]) / 4
    with instrument.triggered(channels[:1], RATE, SHORT, EdgeTrigger(name, level, 0.02)) as task:
        task.arm()
        block = task.wait(5.0)
    at, value = block.trigger_index or 0, block.value(name)
    good = at == round(0.02 * block.sample_rate) and bool(value[at - 1] < level <= value[at])
    advice = "the sample at the trigger index has to be the first at or above the level, after one below it"
    return [*checks, judged("trigger_index", name, good, advice, at, round(0.02 * block.sample_rate))]


def _reconnect(open_instrument: Open, same: bool, channels: Sequence[Channel]) -> Check:
    instrument = open_instrument()
    recorder = instrument.record(channels, RATE, SHORT)
    recorder.record()
    instrument.close()  # in the middle of its task, as a program ends that fails
    with suppress(DaqError):
        recorder.__exit__(None, None, None)
    began = time.monotonic()
    with open_instrument() as again, again.record(channels, RATE, SHORT) as recorder:
        recorder.record()
    took = time.monotonic() - began
    advice = "after a lost connection it has to list the same devices and record again"
    return judged("reconnect", SUBJECT, same and took <= 5 * PROMPT, advice, took, 5 * PROMPT, "s")
