"""Where measured and simulated responses differ, from the two curves alone, without a model of the bench.

The result gives the bands, the difference of each resonance in frequency and height, and whether magnitude or phase
differs more. It names no cause: that takes a simulation whose parts can be changed (see `analysis.gap`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.gap.location import GapMap, Place, map_of, places
from analysis.gap.measurement import Indices
from analysis.modal.response_variance import variance_from_neighbours

PROMINENCE = np.log(2.0)
"""Least prominence of a resonance: logarithm of the factor by which a peak stands out."""
SAME_RESONANCE = 0.2
"""Largest distance of two peaks of one mode, relative to the frequency."""
TRUSTED = 10.0
"""Least height of a peak, in standard deviations of the noise."""
LEAST_NOISE = 1e-3
"""Least standard deviation of a line, relative to the largest response of its row."""


@dataclass(frozen=True)
class Resonance:
    """A resonance that both responses show.

    Attributes:
        measured, simulated: frequency, Hz.
        height: of the simulated peak over the measured one.
    """

    measured: float
    simulated: float
    height: float

    @property
    def shift(self) -> float:
        """By how much the simulated frequency is too high, relative."""
        return self.simulated / self.measured - 1


@dataclass(frozen=True, eq=False)
class ResponseGap:
    """Where two sets of responses differ.

    Attributes:
        percent: 100 sqrt(sum |y - f|^2 / sum |y|^2).
        map: misfit beyond noise by row and band.
        places: the largest parts of it.
        resonances: by row, those that both show.
        statements: the same as text.
    """

    percent: float
    map: GapMap
    places: tuple[Place, ...]
    resonances: tuple[tuple[Resonance, ...], ...]
    statements: tuple[str, ...]


def response_gap(
    frequency: Real, measured: Complex, simulated: Complex, rows: Sequence[str], deviation: Real | None = None
) -> ResponseGap:
    """Locate the gap between responses.

    Args:
        frequency: (lines,) Hz, rising.
        measured, simulated: (rows, lines) in the same unit.
        rows: names.
        deviation: (rows, lines) standard deviation of the measured values per real and imaginary part; by default from
            the scatter of neighbouring lines.

    Raises:
        AnalysisError: shapes differ, there are too few lines, or values are not finite.
    """
    shape = len(rows), frequency.size
    if measured.shape != shape or simulated.shape != shape:
        raise AnalysisError(
            f"responses of shape {measured.shape} and {simulated.shape}; expected (rows, lines) {shape}"
        )
    if frequency.size < 32 or not (np.all(np.isfinite(measured)) and np.all(np.isfinite(simulated))):
        raise AnalysisError("a gap between responses needs 32 lines or more, and finite values")
    if deviation is None:
        scatter = np.sqrt(variance_from_neighbours(measured))
        deviation = np.maximum(scatter, LEAST_NOISE * np.max(np.abs(measured), axis=1, keepdims=True))
    wheres: tuple[dict[str, str | float], ...] = tuple({"row": name} for name in rows)
    data = [(measured[i], simulated[i], deviation[i], frequency) for i in range(len(rows))]
    found = map_of("measured against simulated", "inverse", rows, wheres, data)
    parts = places([found])
    percent = 100 * float(np.linalg.norm(measured - simulated) / np.linalg.norm(measured))
    resonances = tuple(shared_resonances(frequency, *row) for row in zip(measured, simulated, deviation, strict=True))
    return ResponseGap(percent, found, parts, resonances, _statements(percent, rows, parts, resonances))


def shared_resonances(frequency: Real, measured: Complex, simulated: Complex, deviation: Real) -> tuple[Resonance, ...]:
    """Pairs of peaks of two responses (lines,) that belong to one mode: nearest to each other, and near enough."""
    ours, theirs = _peaks(measured, TRUSTED * deviation), _peaks(simulated, TRUSTED * deviation)
    found = []
    for peak in ours:
        if theirs.size == 0:
            break
        nearest = theirs[np.argmin(np.abs(frequency[theirs] - frequency[peak]))]
        back = ours[np.argmin(np.abs(frequency[ours] - frequency[nearest]))]
        if back == peak and abs(frequency[nearest] / frequency[peak] - 1) < SAME_RESONANCE:
            height = float(np.abs(simulated[nearest]) / np.abs(measured[peak]))
            found.append(Resonance(float(frequency[peak]), float(frequency[nearest]), height))
    return tuple(found)


def _peaks(response: Complex, least: Real) -> Indices:
    """Lines of peaks that are higher than `least` (lines,)."""
    size = np.abs(response)
    found, _ = find_peaks(np.log(np.maximum(size, np.finfo(float).tiny)), prominence=PROMINENCE)
    return np.asarray(found[size[found] > least[found]])


def _statements(
    percent: float, rows: Sequence[str], parts: Sequence[Place], resonances: Sequence[Sequence[Resonance]]
) -> tuple[str, ...]:
    said = [f"measured and simulated responses are {percent:.3g} % apart"]
    if not parts:
        return (*said, "nothing of it is beyond noise")
    first = parts[0]
    low, high = first.band
    said.append(
        f"{100 * first.share:.0f} % of the misfit beyond noise is in {first.where['row']} "
        f"from {low:.0f} to {high:.0f} Hz, mostly in {first.part}"
    )
    for name, shared in zip(rows, resonances, strict=True):
        said += [
            f"{name}: the resonance measured at {each.measured:g} Hz is simulated at {each.simulated:g} Hz "
            f"({100 * each.shift:+.1f} %), {each.height:.2g} times as high"
            for each in shared
        ]
    return tuple(said)
