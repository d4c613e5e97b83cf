"""Readings of the beam rig with one effect."""

import numpy as np

from analysis.frequency_response import Complex
from analysis.gap.effect import Effect
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.measurement import Measurement
from analysis.gap.simulation.baseline import baseline_of
from analysis.gap.simulation.free_beam_modes import BeamModes
from analysis.gap.simulation.two_rigs import Simulation


def read(effect: Effect, empty: Measurement, modes: BeamModes, **own: float) -> Complex:
    """(rows, lines) of the first hammer set with one effect on top of the baseline at its centre."""
    simulation = Simulation(baseline_of(empty), modes, (effect,))
    scores = np.zeros(Likelihood(simulation).unknowns)
    for place, parameter in enumerate(effect.parameters, start=len(simulation.baseline.parameters)):
        if parameter.name in own:
            scores[place] = (own[parameter.name] - parameter.centre) / parameter.spread
    return Likelihood(simulation).predict(scores, derivatives=()).accelerances[0]
