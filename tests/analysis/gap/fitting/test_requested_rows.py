"""Predictions at rows that are asked for."""

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.frequency_response import Real
from analysis.gap.effects.joint_amplitude import CubicStiffness
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.requested_rows import at_rows
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter
from tests.analysis.gap.conftest import simulation_of

ASKED = tuple(map(Dof.parse, ("5y", "2y", "10y")))


def place_of(name: str, parameters: tuple[Parameter, ...]) -> int:
    """Index of a parameter."""
    return [each.name for each in parameters].index(name)


@pytest.fixture
def softening(empty: Measurement) -> tuple[Likelihood, Real]:
    """Joints that soften by a tenth and more under blows, with the scores of that model."""
    likelihood = Likelihood(simulation_of(empty.thinned(40), CubicStiffness()))
    scores = np.zeros(likelihood.unknowns)
    scores[place_of("beta", likelihood.parameters)] = -2.0
    return likelihood, scores


def test_a_prediction_does_not_depend_on_what_else_is_asked_for(softening: tuple[Likelihood, Real]) -> None:
    likelihood, scores = softening
    frequency = likelihood.measurement.sets[0].frequency
    at = [at_rows(likelihood, scores, asked, frequency) for asked in (ASKED, ASKED[:1])]
    every, alone = (whole.predict(found, ()).accelerances[0] for whole, found in at)
    assert np.allclose(every[-len(ASKED)], alone[-1], rtol=1e-9, atol=0.0)


def test_rows_that_are_asked_for_leave_measured_ones_as_they_were_fitted(
    softening: tuple[Likelihood, Real],
) -> None:
    likelihood, scores = softening
    whole, found = at_rows(likelihood, scores, ASKED, likelihood.measurement.sets[0].frequency)
    measured = likelihood.predict(scores, ()).accelerances[0]
    assert np.allclose(whole.predict(found, ()).accelerances[0][: len(measured)], measured, rtol=1e-9, atol=0.0)
