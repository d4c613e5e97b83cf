"""The approximate shape of every row of accelerances, before any row is known to be right.

The paper's model with the tester's cylinders is good enough to recognise a row: its shape over frequency, not its size.
"""

from dataclasses import dataclass, replace

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.fitting.fit import Fit, fit
from analysis.gap.fitting.likelihood import Likelihood
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
STARTS = (0.0, -2.0, 2.0)
"""Logarithms of the cylinders' stiffness, over the typical one, at which the fit starts."""
HOLDS = 0.3
"""Cost per datum up to which a fit holds, so that no further start is tried: some 15 % of the measured values are left,
as the noise is inflated."""
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
        scores: (unknowns,) at which it ended.
        cost: chi-square there, under inflated noise and with priors.
        holds: whether that is no more than `HOLDS` per datum.
    """

    measurement: Measurement
    thin: tuple[HammerSet, ...]
    expected: tuple[Complex, ...]
    scores: Real
    cost: float
    holds: bool

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


def rough_fit(measurement: Measurement, also_from: RoughFit | None = None, *, anywhere: bool = False) -> RoughFit:
    """Fit the paper's model by relative errors, so that no single row dominates; the best of several fits counts.

    Args:
        measurement: with any row possibly wrong.
        also_from: a fit to the same rows in another order or polarity. Two more fits start at its end and at the mirror
            image of that.
        anywhere: whether fits start from softer and stiffer cylinders, too, unless one before holds.
    """
    thin = measurement.thinned(LINES)
    # a wrong row would pass for blows that lean, or that fall far beside their marks
    thin = replace(thin, tolerances=replace(thin.tolerances, impact_position=0.0, blow_lean=0.0))
    simulation = Simulation(baseline_of(thin), beam_modes_of(measurement.drawing))
    likelihood = Likelihood(simulation)
    cylinders = np.array([each.name.startswith(("a(", "b(")) for each in simulation.shared])
    typical = [np.pad(start * cylinders, (0, likelihood.unknowns - cylinders.size)) for start in STARTS]
    others = [] if also_from is None else [also_from.scores, _mirrored(simulation, also_from.scores)]
    starts = [*others, *(typical if anywhere else typical[:1])]
    fits, enough = list[Fit](), HOLDS * likelihood.data
    for number, start in enumerate(starts):
        if number > len(others) and min(each.at.cost for each in fits) < enough:
            break
        fits.append(fit(simulation, start, ROUGH, GAIN, STEPS))
    best = min(fits, key=lambda each: each.at.cost)
    return RoughFit(
        measurement, thin.sets, best.readings.accelerances, best.scores, best.at.cost, best.at.cost < enough
    )


def _mirrored(simulation: Simulation, scores: Real) -> Real:
    """(unknowns,) scores with the stiffness in shear and in compression exchanged in each joint.

    If both cylinders of each joint lean by 45 degrees, that is the mirror image: rows along the beam change their sign.
    """
    found, places = scores.copy(), {each.name: place for place, each in enumerate(simulation.shared)}
    for joint in simulation.baseline.measurement.drawing.joints:
        pair = [places[f"{term}({joint.name})"] for term in "ab"]
        shear, compression = (simulation.shared[place] for place in pair)
        values = shear.value(scores[pair[0]]), compression.value(scores[pair[1]])
        found[pair] = shear.score(values[1]), compression.score(values[0])
    return found


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
