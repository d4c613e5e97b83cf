"""A set of accelerances measured with one accelerometer and a roving hammer."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.dof import Dof
from analysis.errors import AnalysisError

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
LARGEST = 1e30
"""Any value beyond this is that of a damaged file; its square would still be a number."""
FEWEST_FOR_SCATTER = 4
"""Least number of blows at a point whose scatter is used: fewer hardly tell how parts of a modal constant scatter."""


@dataclass(frozen=True)
class FrequencyResponses:
    """Accelerances of one roving-hammer set, a row for each point struck.

    Attributes:
        frequency: (lines,) in Hz, rising.
        accelerance: (rows, lines) complex, in (m/s^2)/N.
        response: position of the accelerometer.
        inputs: (rows,) points struck.
        coherence: (rows, lines) in 0..1, or None where it was not measured.
        variance: (rows, lines) variance of the averaged accelerance, per real and imaginary part,
            in ((m/s^2)/N)^2, or None where it is unknown. Lines are taken as independent of each other.
        scatter: (rows, blows, lines) complex, in (m/s^2)/N: how far each blow moves the average of its row. Their outer
            products add up to the covariance of the average, between lines too, because a blow beside its mark changes
            all lines together. None where single blows are unknown or too few.
        decay: in 1/s, of the exponential window that the records carry: lines are then at lambda = decay + i w
            instead of i w, and every mode appears more damped than it is.

    Raises:
        AnalysisError: shapes differ, frequencies do not rise, or a value cannot be one.
    """

    frequency: Real
    accelerance: Complex
    response: Dof
    inputs: tuple[Dof, ...]
    coherence: Real | None = None
    variance: Real | None = None
    scatter: Complex | None = None
    decay: float = 0.0

    def __post_init__(self) -> None:
        if not (np.all(np.isfinite(self.frequency)) and np.all(self.frequency >= 0)):
            raise AnalysisError("frequencies are not all finite numbers from 0 Hz up; correct them in the file")
        if np.any(np.diff(self.frequency) <= 0):
            raise AnalysisError("frequencies do not rise; sort the lines by frequency, each once")
        shape = (len(self.inputs), self.frequency.size)
        for name in ("accelerance", "coherence", "variance"):
            array = getattr(self, name)
            if array is None:
                continue
            if array.shape != shape:
                raise AnalysisError(f"{name} has shape {array.shape}, expected (rows, lines) = {shape}")
            if not np.all(np.isfinite(array)):
                raise AnalysisError(f"{name} holds values that are not finite numbers")
            if np.any(np.abs(array) > LARGEST):
                raise AnalysisError(f"{name} holds values beyond {LARGEST:g}; the file is damaged, export it again")
        if self.variance is not None and np.any(self.variance < 0):
            raise AnalysisError("variance holds values below zero; give the square of a standard deviation")
        if self.scatter is not None and (self.scatter.shape[0], self.scatter.shape[-1]) != shape:
            raise AnalysisError(f"scatter has shape {self.scatter.shape}, expected (rows, blows, lines) of {shape}")

    def row(self, point: Dof) -> int:
        """Index of the row struck at `point`.

        Raises:
            AnalysisError: no row was struck there.
        """
        if point not in self.inputs:
            raise AnalysisError(f"no blow at {point}; struck were {', '.join(map(str, self.inputs))}")
        return self.inputs.index(point)

    def band(self, lowest: float, highest: float) -> FrequencyResponses:
        """The lines from `lowest` to `highest`, Hz, both included."""
        keep = (self.frequency >= lowest) & (self.frequency <= highest)
        return replace(
            self,
            frequency=self.frequency[keep],
            accelerance=self.accelerance[:, keep],
            coherence=None if self.coherence is None else self.coherence[:, keep],
            variance=None if self.variance is None else self.variance[:, keep],
            scatter=None if self.scatter is None else self.scatter[..., keep],
        )


def blows_behind(scatter: Complex) -> Real:
    """(rows,) number of blows in each row of a scatter (rows, blows, lines); missing blows are zero there."""
    return np.asarray(np.sum(np.any(scatter != 0, axis=2), axis=1), dtype=np.float64)
