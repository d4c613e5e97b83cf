"""Were the blows of one point really struck there? What single blows say of each other.

A blow a hand's breadth off has an accelerance of its own: at most lines it differs from the others by half and more,
where blows at one mark differ by a few per cent, through a millimetre, a degree and noise. The median over lines of
that difference needs no model of the structure and no level of noise. Along a stiff direction blows differ by as much
as they are large, because a lean of one degree brings in the soft direction; there nothing can be told, and nothing is.
"""

from __future__ import annotations

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.modal.blow_check import BlowFault, BlowReason

_FEWEST = 3  # of two blows that disagree nobody knows which is wrong
_LARGEST = 0.25  # difference of blows at one mark; neighbouring marks differ by 0.45 and more
_OVER_THE_OTHERS = 4.0  # times the difference of the others among themselves


def check_point(
    force: Real, acceleration: Real, sample_rate: float, band: tuple[float, float]
) -> tuple[BlowReason | None, ...]:
    """Which blows do not fit the others of their point; to be asked again with every blow that is added.

    Args:
        force: (blows, samples) in N, of blows that count by themselves.
        acceleration: (blows, samples) in m/s^2.
        sample_rate: in Hz.
        band: lowest and highest frequency in Hz that are compared.

    Returns:
        For each blow the reason to suspect it, or None. All are None for fewer than three blows.

    Raises:
        AnalysisError: shapes differ, or there are no lines in the band.
    """
    if force.ndim != 2 or force.shape != acceleration.shape:
        raise AnalysisError(f"force has shape {force.shape} and acceleration {acceleration.shape}; give equal ones")
    frequency = np.fft.rfftfreq(force.shape[1], 1 / sample_rate)
    within = (frequency >= band[0]) & (frequency <= band[1])
    if not np.any(within):
        raise AnalysisError(f"there are no lines between {band[0]:g} and {band[1]:g} Hz")
    blows = len(force)
    if blows < _FEWEST:
        return (None,) * blows
    accelerance = np.fft.rfft(acceleration)[:, within] / np.fft.rfft(force)[:, within]
    difference = _differences(accelerance, accelerance)
    opposite = _differences(accelerance, -accelerance)
    return tuple(_judged(difference, opposite[blow], blow, band) for blow in range(blows))


def _differences(one: Complex, other: Complex) -> Real:
    """(blows, blows) median over lines of the difference over the root mean square of both: 0 alike, 2 opposite."""
    size = np.abs(one) ** 2
    return np.array(
        [np.median(np.abs(row - other) * np.sqrt(2 / (own + size)), axis=1) for row, own in zip(one, size, strict=True)]
    )


def _judged(difference: Real, opposite: Real, blow: int, band: tuple[float, float]) -> BlowReason | None:
    others = np.delete(np.arange(len(difference)), blow)
    own = float(np.median(difference[blow, others]))
    pairs = difference[np.ix_(others, others)][np.triu_indices(others.size, 1)]
    among_others = float(np.median(pairs))
    limit = max(_LARGEST, _OVER_THE_OTHERS * among_others)
    if own <= limit:
        return None
    turned = float(np.median(opposite[others])) <= limit
    advice = "it has the opposite sign: turn the hammer round" if turned else "was another point struck?"
    return BlowReason(
        BlowFault.WRONG_POINT,
        f"does not fit its point: between {band[0]:g} and {band[1]:g} Hz the accelerance of this blow differs from the "
        f"others by {100 * own:.0f} %, theirs from each other by {100 * among_others:.0f} %; {advice}",
    )
