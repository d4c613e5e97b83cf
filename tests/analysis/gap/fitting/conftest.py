"""What fits and their likelihood are tested with: a bench with a soft frame, and a model that has it."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from analysis.gap.effects.tester import FrameCompliance
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.simulation.two_rigs import Simulation
from tests.analysis.gap.conftest import Made, simulation_of

WithSmoothErrors = Callable[[float], Likelihood]


@pytest.fixture(scope="session")
def simulation(made: Made) -> Simulation:
    measurement = made((FrameCompliance(),), (0.5,))
    return simulation_of(measurement, FrameCompliance())


@pytest.fixture
def with_smooth_errors(simulation: Simulation) -> WithSmoothErrors:
    """A function that gives the likelihood in which rows of a point have a share of their smooth errors in common."""

    def likelihood_of(common: float) -> Likelihood:
        scales = replace(simulation.baseline.scales, model_error=0.01, correlation=25.0, common=common)
        return Likelihood(simulation.with_scales(scales))

    return likelihood_of
