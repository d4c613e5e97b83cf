"""Accelerances that were not measured, under every effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analysis.dof import Direction, Dof
from analysis.gap.baseline import baseline_of
from analysis.gap.catalogue import candidates
from analysis.gap.diagnosis import predictions
from analysis.gap.fit import Likelihood, evaluated
from analysis.gap.free_beam_modes import bar_of
from analysis.gap.measurement import Measurement
from analysis.gap.simulation import Simulation

UNSEEN = (Dof(5, Direction.Y), Dof(8, Direction.Y), Dof(11, Direction.X))


def test_points_that_nobody_struck_are_predicted_under_every_effect(empty: Measurement) -> None:
    asked = replace(empty, predict=tuple((empty.drawing.accelerometer, point) for point in UNSEEN))
    baseline, bar = baseline_of(asked), bar_of(asked.drawing)
    plain = Likelihood(Simulation(baseline, bar))
    before = evaluated(plain, np.zeros(plain.unknowns))
    for effect in candidates(asked):
        likelihood = Likelihood(Simulation(baseline, bar, (effect,)))
        found = predictions(asked, before, evaluated(likelihood, np.zeros(likelihood.unknowns)))
        assert found is not None
        assert found.after.shape == (len(UNSEEN), found.frequency.size), effect.id
        assert np.all(np.isfinite(found.after)), effect.id
