"""Standards that a set of sine points can claim, in sentences for reports; `docs/standards.md` has the table.

A claim states what was checked here. Requirements that only the laboratory can check, such as conditioning or an
adequate frame, are in the table.
"""

import math
from collections.abc import Sequence

from analysis.direct.cylinder_terms import FREQUENCY_TOLERANCE
from analysis.direct.dynamic_stiffness import DynamicStiffness

ASTM_D5992_BAND = (0.01, 100.0)
"""Hz, ASTM D5992-96 (reapproved 2018), 1.4."""
ISO_10846_2_LOWEST = 1.0
"""Hz, ISO 10846-2:2008, scope."""
LINEARITY_INPUTS_DB, LINEARITY_LEVELS_DB = 10.0, 1.5
"""ISO 10846-2:2008, 7.7: inputs this far apart must give stiffness levels within the second number."""


def claims(points: Sequence[DynamicStiffness]) -> tuple[str, ...]:
    """Claims for points of one specimen and configuration, one sentence a standard; none without points."""
    if not points:
        return ()
    return (_astm_d5992(points), _iso_10846_2(points), _iso_4664_1(points), _iso_18437_4(points))


def linearity_difference_db(points: Sequence[DynamicStiffness]) -> float | None:
    """Largest difference of the level 20 lg |k_d| between amplitudes 10 dB apart or more at one frequency, dB.

    None where a frequency was not measured at two such amplitudes.
    """
    largest = 0.0
    for point in points:
        same = [other for other in points if abs(other.frequency / point.frequency - 1) < FREQUENCY_TOLERANCE]
        apart = [other for other in same if _apart_db(point.amplitude_pp, other.amplitude_pp) >= LINEARITY_INPUTS_DB]
        amplitudes = [other.amplitude_pp for other in same]
        if _apart_db(max(amplitudes), min(amplitudes)) < LINEARITY_INPUTS_DB:
            return None
        largest = max([largest, *(_apart_db(point.magnitude, other.magnitude) for other in apart)])
    return largest


def _apart_db(one: float, other: float) -> float:
    return abs(20 * math.log10(one / other))


def _astm_d5992(points: Sequence[DynamicStiffness]) -> str:
    low, high = ASTM_D5992_BAND
    inside = sum(low <= point.frequency <= high for point in points)
    if inside == len(points):
        return f"ASTM D5992: all {len(points)} points lie within its {low:g}-{high:g} Hz."
    highest = max(point.frequency for point in points)
    lowest = min(point.frequency for point in points)
    outside = f"up to {highest:g} Hz" if highest > high else f"down to {lowest:g} Hz"
    return (
        f"ASTM D5992: {inside} of {len(points)} points lie within its {low:g}-{high:g} Hz; the others, {outside}, "
        "exceed it and claim nothing by it."
    )


def _iso_10846_2(points: Sequence[DynamicStiffness]) -> str:
    low = sum(point.frequency < ISO_10846_2_LOWEST for point in points)
    below = f" {low} points below {ISO_10846_2_LOWEST:g} Hz are outside of its scope." if low else ""
    difference = linearity_difference_db(points)
    if difference is None:
        return (
            "ISO 10846-2: no claim; its test for linearity (7.7) wants every frequency at two amplitudes "
            f"{LINEARITY_INPUTS_DB:g} dB apart." + below
        )
    if difference <= LINEARITY_LEVELS_DB:
        return (
            f"ISO 10846-2: the test for linearity (7.7) is passed, levels at amplitudes {LINEARITY_INPUTS_DB:g} dB "
            f"apart differ by {difference:.1f} dB, {LINEARITY_LEVELS_DB:g} dB or less." + below
        )
    return (
        f"ISO 10846-2: the test for linearity (7.7) is failed, levels at amplitudes {LINEARITY_INPUTS_DB:g} dB apart "
        f"differ by {difference:.1f} dB, more than {LINEARITY_LEVELS_DB:g} dB: a stiffness holds at its own amplitude "
        "only." + below
    )


def _iso_4664_1(points: Sequence[DynamicStiffness]) -> str:
    poor = sum(not point.first_harmonic_sufficient for point in points)
    unseen = sum(point.thd_force is None for point in points)
    if poor:
        return (
            f"ISO 4664-1: forced vibration off resonance; at {poor} of {len(points)} points the first harmonic does "
            "not describe the specimen, and they claim nothing by it."
        )
    if unseen:
        return (
            f"ISO 4664-1: forced vibration off resonance; the wave form of {unseen} of {len(points)} points was not "
            "seen, so whether it was a sine is open."
        )
    return (
        "ISO 4664-1: forced vibration off resonance, stiffness and loss angle of sines; amplitude, preset, temperature "
        "and conditioning have to be reported with them."
    )


def _iso_18437_4(points: Sequence[DynamicStiffness]) -> str:
    difference = linearity_difference_db(points)
    if difference is not None and difference <= LINEARITY_LEVELS_DB:
        return (
            "ISO 18437-4: the specimen is linear at these amplitudes, as its moduli want; a modulus needs the shape "
            "factor besides, so these stiffnesses claim none."
        )
    why = "was not shown" if difference is None else f"is not the case, {difference:.1f} dB between amplitudes"
    return f"ISO 18437-4: no claim; its moduli are those of small, linear strains, which {why}."
