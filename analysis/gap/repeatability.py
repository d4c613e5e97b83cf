"""What measuring again would differ by, below which no gap can fall: on rows that were measured, and on others.

Blows fall beside their marks, and each set-up has a gain of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.dof import Dof
from analysis.gap.fit import Fit, Likelihood
from analysis.gap.held_out import HeldOut
from analysis.gap.measurement import HammerSet, StatedTolerances
from analysis.gap.simulation import Prediction


def floor_percent(found: Fit) -> float:
    """What measuring again would differ by: blows beside their marks, another gain, and noise, in percent.

    The rms over all set-ups of the beam rig; of the tester alone, its noise and gain.
    """
    likelihood = found.likelihood
    measurement = likelihood.measurement
    if not measurement.sets:
        assert measurement.points is not None
        noise = float(np.sum(2 * measurement.points.deviation**2) / np.sum(np.abs(measurement.points.stiffness) ** 2))
        return 100 * float(np.sqrt(noise + measurement.tolerances.tester_gain**2))
    return _differing(measurement.sets, likelihood.predict_some(found.scores, (0,)), measurement.tolerances)


def floor_percent_of(found: Fit, unseen: Sequence[Dof]) -> float:
    """The same for a set struck at points that were not measured, with the noise that the reference set has."""
    likelihood = found.likelihood
    reference = likelihood.measurement.sets[0]
    there = reference.elsewhere(tuple(unseen), reference.frequency)
    other = Likelihood(likelihood.simulation.of(replace(likelihood.measurement, sets=(there,))))
    scores = np.zeros(other.unknowns)
    shared = len(other.simulation.shared)
    scores[:shared] = found.scores[:shared]
    return _differing((there,), other.predict_some(scores, (0,)), likelihood.measurement.tolerances)


def _differing(sets: Sequence[HammerSet], predicted: Prediction, tolerances: StatedTolerances) -> float:
    """Percent, as an rms, by which sets that a model predicts differ from one set-up to another."""
    differing = measured = 0.0
    for number, each in enumerate(sets):
        size = np.abs(predicted.accelerances[number]) ** 2
        beside = np.abs(predicted.by_blow[number]) ** 2
        differing += float(np.sum(tolerances.sensor_gain**2 * size + beside + 2 * each.deviation**2))
        measured += float(np.sum(size))
    return 100 * float(np.sqrt(differing / measured))


def carried_over(found: HeldOut, unseen_floor: float) -> HeldOut:
    """Gaps to expect on rows that were not measured: the model is as wrong there, and the floor is theirs.

    Args:
        found: on rows that were left out in turn.
        unseen_floor: percent by which measuring again would differ on the others.
    """
    if found.inverse is None:
        return found
    change = found.inverse.model_percent**2 + unseen_floor**2 - found.inverse.percent**2

    def there(percent: float) -> float:
        return float(np.sqrt(max(0.0, percent**2 + change)))

    low, high = found.ci90_percent
    return replace(
        found,
        inverse=replace(found.inverse, percent=there(found.inverse.percent)),
        ci90_percent=(there(low), there(high)),
    )
