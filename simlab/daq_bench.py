"""What acquisition needs of the bench, and on which of its samples a trigger falls."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from simlab.clock import Clock
from simlab.daq_modules import Real

BEFORE, AFTER = 32, 8  # samples around a crossing that are looked at: the anti-alias filter rings before an edge


class Bench(Protocol):
    """What a task needs of the bench."""

    @property
    def clock(self) -> Clock:
        """The clock of the bench."""

    def hammer_signals(self, start: float, rate: float, samples: int) -> dict[str, Real]:
        """Signals of the hammer rig, SI (samples,), at bench times start + i / rate."""

    def tester_signals(self, times: Real) -> dict[str, Real]:
        """Signals of the tester, SI (samples,), at bench `times`."""

    def next_crossing(self, channel: str, level: float, after: float) -> float | None:
        """Bench time later than `after` when signal `channel` rises through `level`; None while not known."""


def rising_sample(bench: Bench, level: float, start: float, rate: float, earliest: int) -> int | None:
    """Index of the first sample of ``hammer``, `earliest` or later, at or above `level` N after one below it.

    Sample i is that of bench time start + i / rate. As in the instrument, the trigger is found on the samples: the
    bench only tells where to look. None while no such edge has passed.

    Raises:
        ValueError: the bench cannot tell a crossing of that level.
    """
    after = start + earliest / rate
    while (crossing := bench.next_crossing("hammer", level, after)) is not None and crossing <= bench.clock.now():
        first = max(math.ceil((crossing - start) * rate) - BEFORE, earliest - 1, 0)
        samples = bench.hammer_signals(start + first / rate, rate, BEFORE + AFTER)["hammer"]
        edges = np.flatnonzero((samples[:-1] < level) & (samples[1:] >= level))
        if edges.size:
            return first + int(edges[0]) + 1
        after = crossing
    return None
