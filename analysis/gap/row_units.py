"""Hammer sets that are no accelerances in (m/s^2)/N: recognised by the size of their rows over frequency."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.measurement import HammerSet, Measurement
from analysis.gap.rough_fit import RoughFit, rough_fit

STANDARD_GRAVITY = 9.80665  # m/s^2
STRANGE, ALIKE = 0.5, 0.8
"""Correlation of the middle row with what is expected of it: below the one a unit is doubted, above the other right."""
FAR, NEAR = 4.0, 2.0
"""The same for its size over the size expected, or the inverse of that."""


@dataclass(frozen=True)
class Unit:
    """What a set may be instead; `to_accelerance` gives (lines,) factors for (lines,) frequencies in Hz."""

    name: str
    to_accelerance: Callable[[Real], Complex]


UNITS = (
    Unit("accelerances in g/N", lambda frequency: np.full(frequency.shape, STANDARD_GRAVITY, dtype=complex)),
    Unit("receptances in m/N", lambda frequency: np.asarray((2j * np.pi * frequency) ** 2)),
    Unit("mobilities in (m/s)/N", lambda frequency: np.asarray(2j * np.pi * frequency)),
)


def in_right_units(rough: RoughFit) -> tuple[RoughFit, tuple[str, ...]]:
    """A rough fit to accelerances in (m/s^2)/N, and a sentence about sets that were none.

    The same fit where all sets look as expected, or where no other unit makes them.
    """
    doubted = [number for number in range(len(rough.thin)) if not _looks_right(rough, number, STRANGE, FAR)]
    for numbers in (doubted, *([number] for number in doubted if len(doubted) > 1)):
        for unit in UNITS if numbers else ():
            again = rough_fit(_converted(rough.measurement, numbers, unit))
            if all(_looks_right(again, number, ALIKE, NEAR) for number in doubted):
                which = f"hammer set{'s' if len(numbers) > 1 else ''} {', '.join(str(n + 1) for n in numbers)}"
                return again, (f"{which}: {unit.name}, not accelerances in (m/s^2)/N; put right",)
    return rough, ()


def _looks_right(rough: RoughFit, number: int, correlation: float, size: float) -> bool:
    middle = float(np.median(rough.size(number)))
    return bool(np.median(rough.correlation(number)) > correlation and 1 / size < middle < size)


def _converted(measurement: Measurement, numbers: Sequence[int], unit: Unit) -> Measurement:
    sets = [_to_accelerance(each, unit) if n in numbers else each for n, each in enumerate(measurement.sets)]
    return replace(measurement, sets=tuple(sets))


def _to_accelerance(each: HammerSet, unit: Unit) -> HammerSet:
    factor = unit.to_accelerance(each.frequency)
    return replace(each, accelerance=factor * each.accelerance, deviation=np.abs(factor) * each.deviation)
