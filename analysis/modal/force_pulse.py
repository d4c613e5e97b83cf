"""The force of one blow as a pulse: how long the hammer touches, and up to which frequency it excites.

A harder tip makes a shorter pulse, whose spectrum reaches further.
"""

from dataclasses import dataclass

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Real

CONTACT = 0.1  # of the peak, above which the hammer counts as touching
FALLEN = 20.0  # dB below the largest line


@dataclass(frozen=True, eq=False)
class ForcePulse:
    """The main contact of a blow, and the spectrum of its whole record.

    Attributes:
        duration: s for which the force is above a tenth of its peak, around it.
        frequency: (lines,) Hz, without the line at 0.
        level: (lines,) dB of the amplitude spectrum below its largest line.
        reach: Hz, where the level first falls by 20 dB; None where it does not up to half the sample rate.
    """

    duration: float
    frequency: Real
    level: Real
    reach: float | None


def force_pulse(force: Real, sample_rate: float, trigger_index: int) -> ForcePulse:
    """The pulse of one blow.

    Args:
        force: (samples,) in N, positive when the hammer pushes.
        sample_rate: in Hz.
        trigger_index: sample of the trigger; the median of what comes before it is taken for no force.

    Raises:
        AnalysisError: the record has no positive force.
    """
    force = force - (np.median(force[:trigger_index]) if trigger_index else 0.0)
    peak = int(np.argmax(force))
    if not force[peak] > 0:
        raise AnalysisError("the force record has no pulse; check the hammer's cable and its polarity")
    size = np.abs(np.fft.rfft(force))[1:]
    frequency: Real = np.asarray(np.fft.rfftfreq(force.size, 1 / sample_rate)[1:], dtype=np.float64)
    level: Real = np.asarray(20 * np.log10(np.maximum(size, np.finfo(float).tiny) / np.max(size)), dtype=np.float64)
    return ForcePulse(_duration(force, peak) / sample_rate, frequency, level, _reach(frequency, level))


def _duration(force: Real, peak: int) -> float:
    """Samples between the crossings of a tenth of the peak on both of its sides, as straight lines cross it."""
    threshold = CONTACT * force[peak]
    return _samples_to(force[peak::-1], threshold) + _samples_to(force[peak:], threshold)


def _samples_to(falling: Real, threshold: float) -> float:
    below = np.flatnonzero(falling < threshold)
    if not below.size:
        return float(falling.size - 1)
    first = int(below[0])
    return float(first - (threshold - falling[first]) / (falling[first - 1] - falling[first]))


def _reach(frequency: Real, level: Real) -> float | None:
    after = np.flatnonzero((level < -FALLEN) & (np.arange(level.size) > np.argmax(level)))
    if not after.size:
        return None
    last, first = int(after[0]) - 1, int(after[0])
    return float(np.interp(FALLEN, -level[[last, first]], frequency[[last, first]]))
