"""What a diagnosis says of a model beside its name."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.gap.diagnosis import LAW, TWO_SIDED, estimates
from analysis.gap.effects.beam import AccelerometerMass
from analysis.gap.fit import Likelihood, fit
from analysis.gap.model import Model
from analysis.gap.search import search_of
from tests.analysis.gap.conftest import Made


@pytest.mark.parametrize("score", [0.001, 1.0])
def test_the_size_of_an_effect_is_known_as_well_as_noise_allows_and_no_better_than_its_law(
    made: Made, score: float
) -> None:
    effect = AccelerometerMass()
    simulation = search_of(made((effect,), (score,)), ()).simulation((effect,))
    model = Model((effect,), fit(simulation, np.zeros(Likelihood(simulation).unknowns)))
    (found,) = estimates(model)["accelerometer_mass"].values()
    (parameter,), (place,) = effect.parameters, model.places(0)
    low, high = found.ci90
    assert low < parameter.value(score) < high
    noise = TWO_SIDED * parameter.spread * model.fit.deviations[place]
    assert (high - low) / 2 == pytest.approx(np.hypot(noise, TWO_SIDED * LAW * found.value), rel=0.1)
    assert found.unit == "kg"
