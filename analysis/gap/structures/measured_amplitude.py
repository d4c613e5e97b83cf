"""The range of amplitudes that was measured, to which the parameters of laws of amplitude refer."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.gap.structures.curve import Curve

STANDS_OUT = 5.0
"""Least size of a reading over its deviation at which it counts as measured: noise reaches it once in 10^5 values."""
ORDINARY = 0.9
"""Quantile that stands for the largest amplitude where no reading stands out of its deviation."""


@dataclass(frozen=True, eq=False)
class Amplitudes:
    """Amplitudes by the readings of one curve.

    Attributes:
        sizes: (n,) in one unit for all curves, such as m.
        deviations: (n,) of these, standard deviations; infinite for one that does not count.
    """

    sizes: Real
    deviations: Real


def displacements(curve: Curve, order: int, factor: float | Real = 1.0) -> Amplitudes:
    """Amplitudes of displacement by readings at a `frequency`; those at 0 Hz do not count.

    Args:
        curve: measured.
        order: of the time derivative of displacement that was read.
        factor: from its readings to those for which amplitudes are asked, (n,) or one.
    """
    angular = 2 * np.pi * np.abs(curve.conditions["frequency"])
    moves = angular > 0
    scale = np.abs(factor) / np.where(moves, angular, 1.0) ** order
    deviations = np.where(moves, curve.deviation, np.inf)
    return Amplitudes(np.asarray(np.abs(curve.values) * scale), np.asarray(deviations * np.where(scale, scale, 1.0)))


def amplitude_range(found: Sequence[Amplitudes]) -> tuple[float, float] | None:
    """Least and largest amplitude; None if every reading is zero or does not count.

    Only readings that stand out of their deviations are used. Below resonance, noise of an acceleration is divided by
    a small square of the frequency, and would be the largest displacement.
    """
    sizes = np.concatenate([np.ravel(each.sizes) for each in found])
    deviations = np.concatenate([np.ravel(each.deviations) for each in found])
    counts = np.isfinite(sizes) & np.isfinite(deviations) & (sizes > 0)
    clear = sizes[counts & (sizes > STANDS_OUT * deviations)]
    if clear.size:
        return float(np.min(clear)), float(np.max(clear))
    if np.any(counts):
        least, largest = np.quantile(sizes[counts], (1 - ORDINARY, ORDINARY))
        return float(least), float(largest)
    return None


def check_scale(largest: float) -> None:
    """Refuse an effect of amplitude without an amplitude to which its parameters could refer.

    Raises:
        AnalysisError: `largest` is zero.
    """
    if not largest > 0:
        raise AnalysisError("no displacement other than zero was measured at a frequency above 0 Hz")
