"""Reaching a peak-to-peak amplitude from below, with a tester that reaches less than it is commanded.

Whether the actuator has settled follows from successive cycles of the tester, never from a clock: a clean amplitude is
known after a few cycles, a noisy one needs more.
"""

import math
import statistics
from dataclasses import dataclass
from itertools import pairwise

from rig.errors import RigError
from rig.registers import CYCLES_REPORTED, State
from rig.tester.driver import Tester
from rig.tester.status import TesterStatus

FEWEST_CYCLES = 6
"""Cycles before settling is judged: the latest three are compared with the three before."""
ATTEMPTS = 6
"""Commands at one point at most."""
FIRST_FRACTION = 0.7
"""Share of the target that is commanded first, where the gain of the tester is not known."""
NEARBY = 10.0
"""Largest difference in Hz of a frequency whose gain is a good estimate."""
MARGIN = 0.1
"""Share of the tolerance by which the amplitude that is aimed at is below the target."""
MEAN_ERROR = 0.25
"""Largest error of the mean of the cycles, as a share of the tolerance."""
SIMILAR = 1.25
"""Largest ratio of two targets with about the same gain; beyond it a specimen softens too much."""
LOWERED, STAYED = 0.5, 0.9
"""A command counts as ignored where it is at most the first share of the one before, and the amplitude stays above the
second share of its former value."""
GOOD_ENOUGH = 0.5
"""Share of the tolerance within which the tester's own measurement has to be; the rest is for its difference from the
record."""


@dataclass(frozen=True)
class Reached:
    """The amplitude to which the tester settled.

    Attributes:
        commanded_pp: peak-to-peak amplitude commanded, m.
        amplitude_pp: mean of the latest cycles by the tester's own measurement, m.
        scatter: standard deviation of one cycle's amplitude over its mean.
    """

    commanded_pp: float
    amplitude_pp: float
    scatter: float


class AmplitudeControl:
    """Remembers the gain of the tester (reached over commanded) at each point, for one mounting of a specimen."""

    def __init__(self, tester: Tester) -> None:
        self._tester = tester
        self._gains: dict[tuple[float, float], float] = {}  # by target and frequency

    def approach(self, target_pp: float, frequency: float, tolerance: float) -> Reached:
        """Cycle at `frequency` Hz with `target_pp` m, or as close to it as the limits of the rig allow.

        Args:
            target_pp: wanted peak-to-peak displacement, m.
            frequency: Hz.
            tolerance: relative.

        Returns:
            The amplitude reached, within half of `tolerance` or not.

        Raises:
            RigError: the tester refused, tripped, does not answer, does not settle or does not follow.
        """
        limit = self._tester.limits.largest_amplitude_pp(frequency)
        aim = (1 - MARGIN * tolerance) * target_pp
        gain = self._gain_near(target_pp, frequency)
        commanded_pp = min(FIRST_FRACTION * target_pp if gain is None else aim / gain, limit)
        before: Reached | None = None
        for _ in range(ATTEMPTS):
            self._tester.cycle(commanded_pp, frequency)
            reached = self._settle(commanded_pp, tolerance)
            _check_follows(before, reached)
            before = reached
            self.correct(target_pp, frequency, reached.amplitude_pp / commanded_pp)
            wanted_pp = min(aim * commanded_pp / reached.amplitude_pp, limit)
            if abs(reached.amplitude_pp / target_pp - 1) <= GOOD_ENOUGH * tolerance or wanted_pp == commanded_pp:
                break
            commanded_pp = wanted_pp
        return reached

    def correct(self, target_pp: float, frequency: float, gain: float) -> None:
        """Remember `gain`, reached over commanded amplitude, at a target of `target_pp` m and `frequency` Hz."""
        self._gains[target_pp, frequency] = gain

    def _gain_near(self, target_pp: float, frequency: float) -> float | None:
        """The gain of the nearest frequency at about this amplitude; the specimen softens with the amplitude."""
        similar = {
            known: gain for (target, known), gain in self._gains.items() if 1 / SIMILAR <= target / target_pp <= SIMILAR
        }
        nearest = min(similar, key=lambda known: abs(known - frequency), default=math.inf)
        return similar[nearest] if abs(nearest - frequency) <= NEARBY else None

    def _settle(self, commanded_pp: float, tolerance: float) -> Reached:
        def settled(status: TesterStatus) -> bool:
            return status.state is State.SETTLED and is_steady(status.displacement_pp, tolerance)

        cycles = self._tester.wait(settled, f"settle at {1e3 * commanded_pp:g} mm peak to peak").displacement_pp
        mean = statistics.fmean(cycles)
        return Reached(commanded_pp, mean, cycle_noise(cycles) / mean)


def _check_follows(before: Reached | None, now: Reached) -> None:
    """Check that a much lower command had an effect. Raises RigError where the tester ignored it."""
    if before is None or now.commanded_pp > LOWERED * before.commanded_pp:
        return
    if now.amplitude_pp > STAYED * before.amplitude_pp:
        raise RigError(
            f"the amplitude stays at {1e3 * now.amplitude_pp:.3g} mm peak to peak where {1e3 * now.commanded_pp:.3g} "
            f"mm were commanded after {1e3 * before.commanded_pp:.3g} mm: the tester does not follow its "
            "commands; check it"
        )


def is_steady(cycles: tuple[float, ...], tolerance: float) -> bool:
    """Whether successive `cycles` (latest first) have no trend, and are enough to know their mean well.

    The later half is compared with the earlier half, allowing for the noise of a cycle; the mean has to be known to a
    quarter of `tolerance`, or as well as all the cycles that the tester reports allow.
    """
    if len(cycles) < FEWEST_CYCLES:
        return False
    half = len(cycles) // 2
    later, earlier = statistics.fmean(cycles[:half]), statistics.fmean(cycles[half : 2 * half])
    noise, allowed = cycle_noise(cycles), MEAN_ERROR * tolerance * later
    if noise / math.sqrt(len(cycles)) > allowed and len(cycles) < CYCLES_REPORTED:
        return False
    return abs(later - earlier) <= allowed + 2 * noise * math.sqrt(2 / half)


def cycle_noise(cycles: tuple[float, ...]) -> float:
    """Standard deviation of a cycle from successive differences, which a slow trend does not inflate."""
    squares = [(later - earlier) ** 2 for later, earlier in pairwise(cycles)]
    return math.sqrt(statistics.fmean(squares) / 2)
