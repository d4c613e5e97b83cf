"""The approximate shape of every row of accelerances, before any row is known to be right.

The paper's model with the tester's cylinders is good enough to recognise a row: its shape over frequency, not its size.
"""

from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.fitting.fit import Likelihood, fit
from analysis.gap.fitting.stages import Stage
from analysis.gap.measurement import HammerSet, Measurement
from analysis.gap.simulation.baseline import baseline_of
from analysis.gap.simulation.free_beam_modes import beam_modes_of
from analysis.gap.simulation.two_rigs import Simulation

LINES = 96
"""Lines of each hammer set for the rough fit."""
ROUGH = (Stage(0.5, 150.0, 0.5), Stage(0.3, tester_inflation=0.3))
"""Shares by which noise is inflated for a fit that no single row can lead far astray."""
GAIN, STEPS = 30.0, 6
OUT_OF_NOISE = 3.0
"""Standard deviations from which a line counts for the shape of a row."""
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class RoughFit:
    """A measurement and a rough fit of the paper's model to it; everything by set.

    Attributes:
        measurement: with all lines.
        thin: its sets with few lines.
        expected: (rows, lines) accelerances of the fit for each of `thin`.
    """

    measurement: Measurement
    thin: tuple[HammerSet, ...]
    expected: tuple[Complex, ...]

    def size(self, number: int) -> Real:
        """(rows,) rms of measured rows over that of expected rows."""
        return size_of(self.thin[number].accelerance) / np.maximum(size_of(self.expected[number]), TINY)

    def correlation(self, number: int) -> Real:
        """(rows,) correlation of measured and expected rows; each line is weighted by the root of its size."""
        flat = [
            rows / np.sqrt(np.maximum(np.abs(rows), TINY))
            for rows in (self.thin[number].accelerance, self.expected[number])
        ]
        unit = [rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), TINY) for rows in flat]
        return np.asarray(np.real(np.sum(unit[0] * unit[1].conj(), axis=1)))

    def unlikeness(self, number: int) -> Real:
        """(rows, rows) unlikeness of measured and expected rows: 0 for equal rows, 1 for rows without relation."""
        return _unlikeness(self.thin[number], self.expected[number])

    def unlikeness_between(self, number: int, other: int) -> Real:
        """(rows, rows) unlikeness of the rows of one set and those of another, whatever their polarity."""
        one, against = self.thin[number], self.thin[other].accelerance
        return np.minimum(_unlikeness(one, against), _unlikeness(one, -against))


def rough_fit(measurement: Measurement) -> RoughFit:
    """Fit the paper's model by relative errors, so that no single row dominates."""
    thin = measurement.thinned(LINES)
    simulation = Simulation(baseline_of(thin), beam_modes_of(measurement.drawing))
    found = fit(simulation, np.zeros(Likelihood(simulation).unknowns), ROUGH, GAIN, STEPS)
    return RoughFit(measurement, thin.sets, found.readings.accelerances)


def size_of(rows: Complex) -> Real:
    """(rows,) rms over lines."""
    return np.asarray(np.sqrt(np.mean(np.abs(rows) ** 2, axis=1)))


def _unlikeness(measured: HammerSet, other: Complex) -> Real:
    """Mean over the lines of a measured row that stand out of noise; every line counts alike, a resonance or none."""
    power = np.abs(measured.accelerance)[:, None] ** 2 + np.abs(other) ** 2
    apart = np.abs(measured.accelerance[:, None] - other) ** 2 / np.maximum(power, TINY)
    clear = np.abs(measured.accelerance) > OUT_OF_NOISE * measured.deviation
    clear[~np.any(clear, axis=1)] = True
    return np.asarray(np.sum(apart * clear[:, None], axis=2) / np.sum(clear, axis=1)[:, None])
