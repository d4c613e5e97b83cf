"""Records that a channel clipped: their extreme samples pile up at one value.

A sine stays near its extremes for long, and a converter rounds it there to few values. So the samples at the extreme of
a record are counted against those that the fitted sine has within one step of the converter of its own extreme. More
than twice as many, in half of the cycles or more, do not come from rounding. The step is the smallest difference of two
samples of the record.

Not found is what leaves no equal samples: an amplifier that limits before the converter adds noise of more than a step,
two summed channels of which one clips, and a limit that fewer samples than half of the cycles reach.
"""

import math
from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Real

FINEST_STEP = 1e-9  # of the range; below, differences are rounding
FEWEST_CYCLES = 0.5  # share of the cycles that reach the extreme
EXCESS = 2.0  # factor over the sine's own samples there


@dataclass(frozen=True)
class Saturation:
    """A pile of samples at one end of a record.

    Attributes:
        extreme: "maximum" or "minimum".
        value: of these samples, in the record's unit.
        samples: how many are there.
        expected: how many of a sine at most.
    """

    extreme: str
    value: float
    samples: int
    expected: int


def saturation(record: Real, residual: Real, samples_per_cycle: float) -> Saturation | None:
    """The larger pile of samples at an end of a record, or None where there is none.

    Args:
        record: (samples,) in any unit.
        residual: (samples,) record less fitted sine, in the same unit.
        samples_per_cycle: of the sine.
    """
    step = _step(record)
    found = []
    for sign, extreme in ((1.0, "maximum"), (-1.0, "minimum")):
        own, sine = sign * record, sign * (record - residual)
        at = np.flatnonzero(own > np.max(own) - step / 2)
        expected = int(np.count_nonzero(sine > np.max(sine) - step))
        cycles = math.floor(record.size / samples_per_cycle)
        reached = np.unique(np.floor(at / samples_per_cycle)).size
        if reached >= FEWEST_CYCLES * cycles and at.size > EXCESS * expected:
            found.append(Saturation(extreme, float(record[at[0]]), int(at.size), expected))
    return max(found, key=lambda each: each.samples, default=None)


def _step(record: Real) -> float:
    """The smallest difference of two samples, as far as it is more than rounding."""
    finest = FINEST_STEP * float(np.ptp(record))
    steps = np.diff(np.sort(record))
    return float(np.min(steps[steps > finest], initial=np.ptp(record)))
