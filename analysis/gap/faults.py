"""What is wrong with a measurement itself: found first, named, and taken out before any physics is looked for.

The paper's model with the tester's cylinders is good enough to recognise a row: its shape over frequency, not its size.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.bar import bar_of
from analysis.gap.baseline import baseline_of
from analysis.gap.fit import Likelihood, Stage, fit
from analysis.gap.measurement import HammerSet, Measurement
from analysis.gap.simulation import Simulation

LINES = 96
ROUGH = (Stage(0.5, 150.0, 0.5), Stage(0.3, tester=0.3))
"""Shares by which noise is inflated for a fit that no single row can lead astray."""
REVERSED, ALIKE = -0.6, 0.6
"""Correlation of a row with its prediction below which its polarity is wrong, and above which it is itself."""
DEAD = 0.02
"""Of the size that its prediction has."""


def examined(measurement: Measurement) -> tuple[Measurement, tuple[str, ...]]:
    """The measurement put right, and a sentence for each fault that was found in it.

    Dead rows are left out; rows of wrong polarity and rows that were swapped are put right.
    """
    if not measurement.sets:
        return measurement, ()
    simulation, sets, faults = _rough(measurement), [], []
    for number, each in enumerate(measurement.sets):
        expected = _expected(simulation, each)
        corrected, found = _put_right(each, expected, f"hammer set {number + 1}")
        sets.append(corrected)
        faults += found
    if not faults:
        return measurement, ()
    return replace(measurement, sets=tuple(each for each in sets if each.inputs)), tuple(faults)


def _rough(measurement: Measurement) -> Simulation:
    """The paper's model after a fit in which relative errors count, and no row much."""
    thin = replace(measurement, sets=tuple(_thin(each) for each in measurement.sets))
    return Simulation(baseline_of(thin), bar_of(measurement.drawing))


def _expected(simulation: Simulation, each: HammerSet) -> Complex:
    """(rows, lines) of a thinned set."""
    thin = _thin(each)
    own = simulation.of(replace(simulation.baseline.measurement, sets=(thin,)))
    found = fit(own, np.zeros(Likelihood(own).unknowns), ROUGH, 30.0, 6)
    return found.likelihood.predict(found.scores, derivatives=False).accelerances[0]


def _put_right(each: HammerSet, expected: Complex, name: str) -> tuple[HammerSet, list[str]]:
    thin, faults = _thin(each), list[str]()
    accelerance, deviation = each.accelerance.copy(), each.deviation.copy()
    size = np.sqrt(np.mean(np.abs(thin.accelerance) ** 2, axis=1) / np.mean(np.abs(expected) ** 2, axis=1))
    alive = size > DEAD * np.median(size)
    alike = _correlation(thin.accelerance, expected)
    for row, dof in enumerate(each.inputs):
        if not alive[row]:
            faults.append(f"{name}: row {dof} is dead (it has {100 * size[row]:.2g} % of the size expected); left out")
    for first in range(len(each.inputs)):
        for second in range(first + 1, len(each.inputs)):
            rows = [first, second]
            if not (alive[first] and alive[second]) or max(alike[first, first], alike[second, second]) > ALIKE / 2:
                continue
            if min(alike[first, second], alike[second, first]) > ALIKE:
                accelerance[rows], deviation[rows] = accelerance[rows[::-1]], deviation[rows[::-1]]
                alike[rows] = alike[rows[::-1]]
                faults.append(f"{name}: rows {each.inputs[first]} and {each.inputs[second]} are swapped; put right")
    for row, dof in enumerate(each.inputs):
        if alive[row] and alike[row, row] < REVERSED:
            accelerance[row] = -accelerance[row]
            faults.append(f"{name}: row {dof} has the wrong polarity; put right")
    corrected = replace(each, accelerance=accelerance, deviation=deviation)
    return (corrected if np.all(alive) else corrected.rows(alive)), faults


def _correlation(measured: Complex, expected: Complex) -> Real:
    """(rows, rows) of measured rows with expected ones, each line counting by the root of its size."""
    tiny = float(np.finfo(float).tiny)
    flat = [rows / np.sqrt(np.maximum(np.abs(rows), tiny)) for rows in (measured, expected)]
    unit = [rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), tiny) for rows in flat]
    return np.asarray(np.real(unit[0] @ unit[1].conj().T))


def _thin(each: HammerSet) -> HammerSet:
    return each.lines(np.arange(0, each.frequency.size, max(1, each.frequency.size // LINES)))
