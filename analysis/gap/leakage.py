"""What a tone leaks into the lines beside its own, taken off.

A record holds no whole number of periods of the mains, which is never quite at its 50 or 60 Hz. Seen through the
record, the tone then stands at its line with C, and k lines on with C d / (d - k), d being how far off its line it is,
in lines (F. J. Harris, Proc. IEEE 66, 1978, for the rectangular window). Averages divide by the force, which is smooth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.measurement import HammerSet

AROUND, DEGREE = 30, 5
"""Lines on either side of a tone in which accelerances are a polynomial of this degree, beside what leaks."""
FARTHEST = 0.45
"""Lines by which a tone may be off the line that it is nearest to."""


def without_leakage(sets: Sequence[HammerSet], tones: Sequence[float]) -> tuple[HammerSet, ...]:
    """Hammer sets without what tones leak, which are all off by the same share of their frequency."""
    above = below = 0.0
    heights = [[_height_and_leak(each, tone) for tone in tones] for each in sets]
    for each, of_set in zip(sets, heights, strict=True):
        for tone, found in zip(tones, of_set, strict=True):
            if found is not None:
                height, leak = found
                per_line = tone / _spacing(each)
                above -= per_line * float(np.vdot(height, leak).real)
                below += per_line**2 * float(np.vdot(height, height).real)
    off = above / below if below > 0 else 0.0
    return tuple(_cleaned(each, tones, of_set, off) for each, of_set in zip(sets, heights, strict=True))


def _height_and_leak(each: HammerSet, tone: float) -> tuple[Complex, Complex] | None:
    """(rows,) C, and what is found of -C d; None where the tone is too near to an end of the lines."""
    line = int(np.argmin(np.abs(each.frequency - tone)))
    if not AROUND <= line < each.frequency.size - AROUND:
        return None
    away = np.arange(-AROUND, AROUND + 1)
    at_tone = (away == 0).astype(float)
    leak = np.where(away == 0, 0.0, 1 / np.where(away == 0, 1, away))
    smooth = np.vander(away / AROUND, DEGREE + 1)
    found, *_ = np.linalg.lstsq(
        np.column_stack([smooth, at_tone, leak]), each.accelerance[:, line + away].T.astype(complex), rcond=None
    )
    return found[-2], found[-1]


def _cleaned(
    each: HammerSet, tones: Sequence[float], heights: Sequence[tuple[Complex, Complex] | None], off: float
) -> HammerSet:
    accelerance = each.accelerance.copy()
    for tone, found in zip(tones, heights, strict=True):
        if found is not None:
            line = int(np.argmin(np.abs(each.frequency - tone)))
            lines_off = float(np.clip(off * tone / _spacing(each), -FARTHEST, FARTHEST))
            away = np.arange(each.frequency.size) - line
            shape: Real = np.where(away == 0, 0.0, lines_off / (lines_off - np.where(away == 0, 1, away)))
            accelerance -= found[0][:, None] * shape
    return replace(each, accelerance=accelerance)


def _spacing(each: HammerSet) -> float:
    return float(np.median(np.diff(each.frequency)))
