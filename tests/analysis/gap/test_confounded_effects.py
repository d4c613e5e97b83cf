"""What cannot be told apart is named."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np

from analysis.gap.confounded_effects import twins
from analysis.gap.effect import Effect
from analysis.gap.effects.beam import Density, YoungsModulus
from analysis.gap.effects.joint_state import TemperatureShift
from analysis.gap.effects.measuring_chain import SensorGain
from analysis.gap.effects.tester import FrameCompliance
from analysis.gap.fit import Fit, Likelihood
from analysis.gap.model import Model
from analysis.gap.verdict import UNKNOWN, Weighed
from analysis.inverse.levenberg_marquardt import Linearised


def weighed(probability: float, *effects: Effect, score: float = 1.0) -> Weighed:
    """An explanation whose parameters are each `score` standard deviations large and well known."""
    shared = tuple(parameter for effect in effects for parameter in effect.parameters)
    simulation = SimpleNamespace(shared=shared, baseline=SimpleNamespace(parameters=()))
    likelihood = cast("Likelihood", SimpleNamespace(simulation=simulation, data=1))
    normal = 1e4 * np.eye(len(shared))
    fit = Fit(likelihood, np.full(len(shared), score), Linearised(0.0, np.zeros(len(shared)), normal), True)
    ids = tuple(sorted(each.id for each in effects))
    return Weighed(ids, Model(tuple(effects), fit), float(np.log(probability)), probability)


def test_an_explanation_nearly_as_probable_is_a_twin() -> None:
    found = [weighed(0.6, YoungsModulus()), weighed(0.3, Density()), weighed(0.01, FrameCompliance())]
    assert twins(found) == (("youngs_modulus", "density"),)


def test_a_clear_verdict_has_no_twin_and_neither_has_none() -> None:
    assert twins([weighed(0.98, YoungsModulus()), weighed(0.01, Density())]) == ()
    assert twins([weighed(0.6), weighed(0.4, Density())]) == ()


def test_the_unknown_is_nobody_s_twin() -> None:
    unknown = Weighed(UNKNOWN, weighed(0.4, Density()).model, -1.0, 0.4)
    assert twins([weighed(0.6, YoungsModulus()), unknown]) == ()
    assert twins([unknown, weighed(0.3, YoungsModulus())]) == ()


def test_twins_in_a_pair_stand_beside_what_both_explanations_share() -> None:
    found = [
        weighed(0.5, FrameCompliance(), YoungsModulus()),
        weighed(0.3, FrameCompliance(), Density()),
        weighed(0.2, SensorGain(), TemperatureShift()),
    ]
    assert twins(found) == (("youngs_modulus", "density"),)
