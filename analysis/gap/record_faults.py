"""What is wrong with single blows, by the checks that a blow has to pass while it is measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.errors import AnalysisError
from analysis.gap.estimate import Estimate
from analysis.gap.measurement import RawBlow
from analysis.gap.record_effect import RecordEffect
from analysis.modal.blow_check import BlowFault, BlowLimits, BlowVerdict, check_blow

DOUBLE_HIT = "double_hit"
ONSET = 0.1
"""Of the peak, which the force passes when the hammer touches."""
SPOILT = (BlowFault.OVERLOAD, BlowFault.CLIPPED, BlowFault.NO_RESPONSE)
"""Faults that spoil a record, beside a double hit; the others are about how the session was to strike."""


def record_faults(blows: Sequence[RawBlow]) -> tuple[RecordEffect | None, tuple[str, ...]]:
    """Double hits as an effect of the catalogue, and a sentence for every other fault of a record."""
    bouncing, faults = list[tuple[RawBlow, BlowVerdict]](), list[str]()
    for blow in blows:
        try:
            verdict = check_blow(blow.force, blow.acceleration, blow.sample_rate, _onset(blow), BlowLimits())
        except AnalysisError as error:
            faults.append(f"blow {blow.name} at {blow.point} cannot be checked: {error}")
            continue
        faults += [f"blow {blow.name} at {blow.point}: {each}" for each in verdict.reasons if each.fault in SPOILT]
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
        {"ratio": Estimate(middle, (middle - half, middle + half), "1")},
        f"{len(bouncing)} of {struck} blows kept are double hits: {'; '.join(reasons)}",
    )
