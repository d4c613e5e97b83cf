"""Schedules of successive fits to a measurement, from few lines under inflated noise to all of them under their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.gap.measurement import Measurement


@dataclass(frozen=True)
class Stage:
    """One of several successive fits, which avoid local minima.

    Attributes:
        inflation: share of |H| by which the noise of accelerances is inflated.
        highest: end of the band, Hz.
        tester_inflation: share of |k| by which the noise of the tester is inflated.
        lines: number of lines of each hammer set that are enough under this noise; None for all.
    """

    inflation: float = 0.0
    highest: float = np.inf
    tester_inflation: float = 0.0
    lines: int | None = None

    def seen(self, measurement: Measurement) -> Measurement:
        """The part of a measurement that is fitted; the same object if that is all of it."""
        if self.highest < np.inf:
            sets = tuple(each.lines(each.frequency <= self.highest) for each in measurement.sets)
            measurement = replace(measurement, sets=sets)
        return measurement if self.lines is None else measurement.thinned(self.lines)


def with_lines(schedule: Sequence[Stage], measurement: Measurement) -> tuple[Stage, ...]:
    """The stages that have lines of every hammer set, whose band may begin above the end of others."""
    lowest = max((float(each.frequency[0]) for each in measurement.sets), default=0.0)
    return tuple(stage for stage in schedule if stage.highest >= lowest)


FINAL = Stage()
FROM_AFAR = (
    *(Stage(share, highest, share, lines=32) for share, highest in ((0.5, 150.0), (0.3, 300.0), (0.1, 600.0))),
    *(Stage(share, tester_inflation=share, lines=64) for share in (0.03, 0.01)),
    FINAL,
)
"""Schedule for a start at the centre of the priors."""
CLOSE = (Stage(0.1, tester_inflation=0.1, lines=32), Stage(0.03, tester_inflation=0.03, lines=64), FINAL)
"""Schedule for a start near the solution."""
CLOSER = (Stage(0.03, tester_inflation=0.03, lines=32), Stage(0.01, tester_inflation=0.01, lines=64), FINAL)
"""Schedule for a start from a model that holds to about a hundredth: more noise would hide a narrow resonance."""
NEAR = (Stage(lines=32), Stage(lines=64), FINAL)
"""Schedule for a start from a model that nearly holds: inflated noise would hide what a small effect does."""
FROM_TESTER = (*(Stage(share, lines=32) for share in (1.0, 0.3, 0.1)), Stage(0.03, lines=64), FINAL)
"""Schedule for a law of the elastomer: the tester shows it, and the beam follows in later stages."""
