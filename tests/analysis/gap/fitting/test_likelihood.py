"""The likelihood of a model: its sum of squares, normal equations and whitened columns are one."""

import numpy as np
import pytest

from analysis.gap.fitting.likelihood import LastState, Likelihood
from analysis.gap.simulation.two_rigs import Simulation
from tests.analysis.gap.fitting.conftest import WithSmoothErrors


def test_a_shared_state_is_computed_again_for_other_scores(simulation: Simulation) -> None:
    zero = np.zeros(Likelihood(simulation).unknowns)
    sharing = Likelihood(simulation, last_state=LastState(zero))
    for scores in (zero, zero + 0.1, zero):
        assert sharing.at(scores).cost == Likelihood(simulation).at(scores).cost


@pytest.mark.parametrize("common", [0.0, 0.7, 1.0])
def test_sum_of_squares_normal_equations_and_whitened_columns_are_one_likelihood(
    simulation: Simulation, with_smooth_errors: WithSmoothErrors, common: float
) -> None:
    """Whatever share of their smooth errors the sets have in common."""
    likelihood = with_smooth_errors(common)
    values = 0.1 * np.random.default_rng(2).standard_normal(likelihood.unknowns)
    shared, left = likelihood.columns(values, range(len(simulation.shared)))
    columns = np.concatenate([shared, likelihood.own_columns(values)])
    at = likelihood.at(values)
    linearised = at.linearised()
    assert at.cost == pytest.approx(left @ left + values @ values)
    assert linearised.cost == pytest.approx(at.cost)
    size = np.abs(np.diag(linearised.normal))
    assert np.allclose(linearised.normal, columns @ columns.T + np.eye(len(values)), rtol=0, atol=1e-6 * size.max())
    assert np.allclose(
        linearised.descent, columns @ left - values, rtol=0, atol=1e-6 * np.abs(linearised.descent).max()
    )
