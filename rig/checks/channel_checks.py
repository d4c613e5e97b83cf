"""Checks of the input channels: at rest, on a hand-held calibrator, and on a suspended mass."""

from collections.abc import Sequence

import numpy as np

from analysis.chain import (
    Calibrator,
    FoundSensitivity,
    apparent_mass,
    found_sensitivity,
    level_of,
    mass_if_swapped,
)
from analysis.errors import AnalysisError
from daq.block import Block
from daq.channels import Channel, ChannelKind
from daq.instrument import Teds
from rig.checks.check import Check, judged, not_done

MOST_NOISE, LEAST_NOISE = 2.0, 0.25
"""Limits of the noise over that of the data sheet: a bad cable makes more, an input without a sensor less."""
MOST_HUM = 0.5
"""Largest rms of hum over the noise of the data sheet."""
MOST_ZERO = 0.02
"""Largest mean at rest of a voltage or bridge channel, over the larger absolute end of its range."""
ZERO_ADVICE = {
    ChannelKind.VOLTAGE: "take the load off, then set the zero at the conditioner",
    ChannelKind.FORCE_BRIDGE: "take the load off; where that does not help, the load cell was overloaded or is screwed "
    "down with a strain",
}
"""What to do about a wrong zero, by the kinds of channels whose zero is checked."""
SENSITIVITY_WITHIN = 0.05
"""Largest relative difference of a sensitivity from the channel table: 3 % for the calibrator, and mounting."""
LEAST_PURITY = 0.9
"""Smallest share of the tone in the rms of a record on a calibrator."""
FREQUENCY_WITHIN = 0.015
"""Largest relative difference of a calibrator's frequency from its nominal one."""
MASS_WITHIN = 0.07
"""Largest relative difference of the apparent mass: 3 % for each sensitivity, the rest for a blow beside the centre."""
LEAST_CORRELATION = 0.95
"""Smallest correlation of force and acceleration on a rigid mass."""


def checks_at_rest(block: Block, channel: Channel) -> list[Check]:
    """Overload, noise, hum, and for voltages and bridges the zero, of a channel while nothing moves."""
    overload = _overload(block, channel)
    if overload.advice:
        later = "remove the overload first"
        return [overload, *(not_done(each, channel.name, later) for each in ("noise", "hum"))]
    values = block.value(channel.name)
    level = level_of(values, block.sample_rate)
    found = [overload]
    if channel.noise is None:
        needed = f"write noise, in {channel.unit} rms by the data sheets, into the channel table"
        found += [not_done(each, channel.name, needed) for each in ("noise", "hum")]
    else:
        found += [
            _noise(channel, channel.noise, level.noise),
            judged(
                "hum", channel.name, level.hum <= MOST_HUM * channel.noise,
                f"mains of {level.mains:g} Hz: look for a ground loop, a broken screen, or a cable beside a supply",
                level.hum, MOST_HUM * channel.noise, channel.unit,
            ),
        ]  # fmt: skip
    if channel.kind in ZERO_ADVICE:
        most, advice = MOST_ZERO * max(abs(channel.minimum), abs(channel.maximum)), ZERO_ADVICE[channel.kind]
        found.append(judged("zero", channel.name, abs(level.mean) <= most, advice, level.mean, most, channel.unit))
    return found


def _overload(block: Block, channel: Channel) -> Check:
    values = block.value(channel.name)
    is_constant = np.ptp(values) < 0.01 * np.max(np.abs(values))
    if not is_constant:
        advice = "its input is overloaded with nothing moving: look for a loose cable or another source"
    elif channel.excitation_current:
        advice = "the input stands at its end: the supply current finds no sensor; look for an open cable"
    elif channel.bridge is not None:
        advice = (
            "the input stands at its end: look for an open wire of the bridge, and whether the sensor is a "
            f"{channel.bridge.configuration} bridge"
        )
    else:
        advice = "the input stands at its end: the sensor is saturated; bring it back into its stroke or range"
    largest, most = float(np.max(np.abs(values))), max(abs(channel.minimum), abs(channel.maximum))
    good = channel.name not in block.overloaded
    return judged("overload", channel.name, good, advice, largest, most, channel.unit)


def _noise(channel: Channel, stated: float, noise: float) -> Check:
    if noise < LEAST_NOISE * stated:
        advice = "less noise than the sensor has by itself: is it connected and fed, and is the sensitivity right?"
        return judged("noise", channel.name, False, advice, noise, LEAST_NOISE * stated, channel.unit)
    advice = "more noise than by the data sheets: look for a bad contact, a worn cable or a wrong sensitivity"
    return judged("noise", channel.name, noise <= MOST_NOISE * stated, advice, noise, MOST_NOISE * stated, channel.unit)


def check_of_sensor(teds: Teds, channel: Channel, table: Sequence[Channel]) -> Check:
    """Whether the sensor at the input of `channel` is that of the channel table, by what it says of itself."""
    said = f"serial number {teds.serial} of maker {teds.manufacturer}, model {teds.model}"
    if not channel.serial:
        return not_done("sensor", channel.name, f"its data sheet has {said}: write serial into the channel table")
    others = [each.name for each in table if each is not channel and teds.is_of(each.serial)]
    advice = (
        "another sensor is connected than the channel table has: take its sensitivity and serial from its certificate"
    )
    if others:
        advice = f"the sensor of {', '.join(others)} is connected here: cables or rows of the channel table are swapped"
    return judged("sensor", channel.name, teds.is_of(channel.serial), advice, said, channel.serial)


def checks_on_calibrator(
    block: Block, channel: Channel, calibrator: Calibrator
) -> tuple[list[Check], FoundSensitivity | None]:
    """Checks of the accelerometer on a calibrator, and its sensitivity; None without a pure tone of that frequency."""
    try:
        found = found_sensitivity(block.at_input(channel.name), block.sample_rate, calibrator)
    except AnalysisError:
        heard = ", ".join(other for other in block.names if other != channel.name and _hears(block, other, calibrator))
        advice = f"no tone of {calibrator.frequency:g} Hz: is the calibrator switched on, and its sensor this one?"
        if heard:
            advice = f"the tone arrives at {heard}: cables or rows of the channel table are swapped"
        return [judged("tone", channel.name, False, advice, heard or "no tone", channel.name)], None
    sounds = abs(found.frequency / calibrator.frequency - 1) <= FREQUENCY_WITHIN and found.purity >= LEAST_PURITY
    deviation, unit = found.sensitivity / channel.sensitivity - 1, channel.sensitivity_unit
    return [
        judged(
            "tone", channel.name, sounds, "mount the sensor tightly, and see that the calibrator has a full battery",
            found.frequency, calibrator.frequency, "Hz",
        ),
        judged(
            "sensitivity", channel.name, sounds and abs(deviation) <= SENSITIVITY_WITHIN,
            f"the channel table has {channel.sensitivity:g} {unit}, {100 * deviation:+.3g} % off: compare "
            "it with the certificate and its unit (per g or per m/s^2), and have a damaged sensor calibrated",
            found.sensitivity, channel.sensitivity, unit,
        ),
    ], found if sounds else None  # fmt: skip


def _hears(block: Block, name: str, calibrator: Calibrator) -> bool:
    try:
        found_sensitivity(block.at_input(name), block.sample_rate, calibrator)
    except AnalysisError:
        return False
    return True


def checks_on_mass(block: Block, hammer: Channel, accelerometer: Channel, mass: float) -> list[Check]:
    """Checks of hammer and accelerometer against each other, by blows on a suspended mass of `mass` kg."""
    subject = f"{hammer.name}, {accelerometer.name}"
    try:
        found = apparent_mass(block.value(hammer.name), block.value(accelerometer.name))
    except AnalysisError as error:
        return [judged("blow", subject, False, str(error))]
    struck = abs(found.correlation) >= LEAST_CORRELATION
    blow = judged(
        "blow", subject, struck,
        "force and acceleration do not follow each other: strike the mass through its centre, and look whether both "
        "sensors are connected and fed",
        found.correlation, LEAST_CORRELATION,
    )  # fmt: skip
    if not struck:
        return [blow, *(not_done(each, subject, "strike once more") for each in ("polarity", "ratio", "cables"))]
    swapped = mass_if_swapped(mass, hammer.sensitivity, accelerometer.sensitivity)
    looks_swapped = abs(abs(found.mass) / swapped - 1) <= MASS_WITHIN
    if abs(swapped / mass - 1) <= 2 * MASS_WITHIN:
        cables = not_done("cables", subject, f"with {mass:g} kg swapped cables look alike; take another mass")
    else:
        advice = "the cables of hammer and accelerometer are swapped, or their rows in the channel table"
        cables = judged("cables", subject, not looks_swapped, advice, "swapped" if looks_swapped else "as in the table")
    pushes = found.mass > 0 and found.peak_force > 0
    turned = "the accelerometer" if found.peak_force > 0 else "the hammer"
    return [
        blow,
        judged(
            "polarity", subject, pushes, f"{turned} shows the wrong sign: turn it round, or correct its polarity",
            "same" if pushes else "opposite", "same",
        ),
        judged(
            "ratio", subject, abs(abs(found.mass) / mass - 1) <= MASS_WITHIN,
            f"force over acceleration is {abs(found.mass):.3g} kg in place of {mass:g} kg: check both sensitivities "
            "and their units, the accelerometer first, by a calibrator",
            abs(found.mass), mass, "kg",
        ),
        cables,
    ]  # fmt: skip
