"""Faults of a measurement itself: found before any effect is looked for, named, and taken out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.errors import AnalysisError
from analysis.gap.effect import RecordEffect
from analysis.gap.faults.mains_detection import found_hum, mains_hum, without_tones
from analysis.gap.faults.row_faults import correct_rows
from analysis.gap.measurement import Configuration, Measurement, RawBlow
from analysis.gap.parameter import ParameterEstimate
from analysis.modal.blow_check import BlowFault, BlowLimits, BlowVerdict, check_blow

DOUBLE_HIT = "double_hit"
ONSET = 0.1
"""Share of the peak force at which the hammer is taken to touch."""
UNUSABLE = (BlowFault.OVERLOAD, BlowFault.CLIPPED, BlowFault.NO_RESPONSE)
"""Faults that spoil a record, apart from double hits; other faults concern the rules of the hammer session."""


def record_faults(blows: Sequence[RawBlow]) -> tuple[RecordEffect | None, tuple[str, ...]]:
    """Double hits as an effect of the catalogue, and a sentence for every other fault of a record."""
    bouncing, faults = list[tuple[RawBlow, BlowVerdict]](), list[str]()
    for blow in blows:
        try:
            verdict = check_blow(blow.force, blow.acceleration, blow.sample_rate, _onset(blow), BlowLimits())
        except AnalysisError as error:
            faults.append(f"blow {blow.name} at {blow.point} cannot be checked: {error}")
            continue
        faults += [f"blow {blow.name} at {blow.point}: {each}" for each in verdict.reasons if each.fault in UNUSABLE]
        if BlowFault.DOUBLE_HIT in verdict.faults:
            bouncing.append((blow, verdict))
    return (_double_hit(bouncing, len(blows)) if bouncing else None), tuple(faults)


def _onset(blow: RawBlow) -> int:
    """Sample of the first touch; a bundle does not say where the trigger was."""
    return int(np.argmax(blow.force > ONSET * np.max(blow.force)))


def _double_hit(bouncing: Sequence[tuple[RawBlow, BlowVerdict]], struck: int) -> RecordEffect:
    ratios = np.array([verdict.second_contact for _, verdict in bouncing])
    reasons = [
        f"{blow.name} at {blow.point}, {reason}"
        for blow, verdict in bouncing
        for reason in verdict.reasons
        if reason.fault is BlowFault.DOUBLE_HIT
    ]
    middle, half = float(np.mean(ratios)), 1.645 * float(np.std(ratios))
    return RecordEffect(
        DOUBLE_HIT,
        {"ratio": ParameterEstimate(middle, (middle - half, middle + half), "1")},
        f"{len(bouncing)} of {struck} blows kept are double hits: {'; '.join(reasons)}",
    )


def soft_in_compression(measurement: Measurement) -> tuple[str, ...]:
    """A sentence for each specimen that the tester finds softer in compression than in shear, which no elastomer is.

    The tester reads one cylinder in compression and two in shear.
    """
    points, found = measurement.points, list[str]()
    if points is None:
        return ()
    for number, joint in enumerate(measurement.drawing.joints):
        read = {
            each: points.stiffness.real[(points.specimen == number) & (points.configuration == each)]
            for each in (Configuration.COMPRESSION, Configuration.SHEAR)
        }
        if all(each.size for each in read.values()):
            compression, shear = (float(np.median(each)) for each in read.values())
            if compression < shear / 2:
                found.append(
                    f"specimen {joint.name}: a cylinder has {compression:.3g} N/m in compression and {shear / 2:.3g} "
                    "N/m in shear; check whether the two configurations are exchanged"
                )
    return tuple(found)


@dataclass(frozen=True, eq=False)
class ExaminedMeasurement:
    """A measurement without its faults.

    Attributes:
        measurement: corrected as far as possible; the same object where nothing had to be changed.
        faults: a sentence for each fault that was found.
        effects: effects of the catalogue that records alone show; each is among the faults, too.
    """

    measurement: Measurement
    faults: tuple[str, ...]
    effects: tuple[RecordEffect, ...]


def examine(measurement: Measurement) -> ExaminedMeasurement:
    """Find faults of a measurement and correct them.

    Lines with mains hum and dead rows are left out; sets in another unit, rows of wrong polarity and swapped rows are
    corrected. Blows that bounced stay in the averages, where they only lower coherence. Configurations that may be
    exchanged are named and stay as they are.

    Raises:
        AnalysisError: every row is dead.
    """
    double_hit, faults = record_faults(measurement.blows)
    hum = mains_hum(measurement)
    faults += soft_in_compression(measurement)
    effects = [] if double_hit is None else [double_hit]
    if hum is not None:
        effects.append(found_hum(hum))
        measurement = without_tones(measurement, hum)
    if measurement.sets:
        measurement, of_rows = correct_rows(measurement)
        faults += of_rows
    return ExaminedMeasurement(measurement, (*faults, *(each.fault for each in effects)), tuple(effects))
