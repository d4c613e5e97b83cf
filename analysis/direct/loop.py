"""The loop of force over displacement in one cycle, whose area is the energy that a cycle dissipates."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from analysis.direct.sine import fit_sine
from analysis.frequency_response import Real

POINTS = 64
HARMONICS = 3
"""Enough to show that a loop is no ellipse, as where a joint stiffens or slips."""


@dataclass(frozen=True, eq=False)
class Loop:
    """One mean cycle of a record, about the mean of each signal.

    Attributes:
        displacement: (points + 1,) m; the last point is the first.
        force: (points + 1,) N.
        dissipated: J in one cycle, the area of the loop.
    """

    displacement: Real
    force: Real
    dissipated: float


def loop_of(displacement: ArrayLike, force: ArrayLike, sample_rate: float, frequency: float) -> Loop:
    """The loop of a sine point: three harmonics that are fitted to all cycles of its record.

    Args:
        displacement: (samples,) in m.
        force: (samples,) in N.
        sample_rate: in Hz.
        frequency: as driven, in Hz.

    Raises:
        AnalysisError: the record is no sine; see `fit_sine`.
    """
    signals = np.stack([np.asarray(displacement, dtype=float), np.asarray(force, dtype=float)])
    fit = fit_sine(signals, sample_rate, frequency, harmonics=HARMONICS, refine=False, names=("displacement", "force"))
    order = np.arange(1, fit.harmonics.shape[1] + 1)
    turns = np.exp(2j * np.pi * np.outer(order, np.arange(POINTS + 1) / POINTS))
    moved, pushed = (fit.harmonics @ turns).real
    # the integral of F dx over a cycle: each harmonic of the force works on that of the motion alone
    work = np.pi * np.sum(order * (fit.harmonics[1] * fit.harmonics[0].conj()).imag)
    return Loop(moved, pushed, float(work))
