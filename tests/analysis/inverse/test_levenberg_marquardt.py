from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis.inverse.levenberg_marquardt import Linearised, inverse, minimise

Real = NDArray[np.float64]


class Rosenbrock:
    """The bent valley 100 (y - x^2)^2 + (1 - x)^2, with its minimum of zero at (1, 1)."""

    data = 2

    def cost(self, values: Real) -> float:
        residual = self.residual(values)
        return float(residual @ residual)

    def residual(self, values: Real) -> Real:
        x, y = values
        return np.array([10 * (x**2 - y), x - 1])

    def linearised(self, values: Real) -> Linearised:
        jacobian = np.array([[-20 * values[0], 10.0], [-1.0, 0.0]])
        return Linearised(self.cost(values), jacobian.T @ self.residual(values), jacobian.T @ jacobian)


@settings(deadline=None)
@given(x=st.floats(-3, 3), y=st.floats(-3, 3))
def test_a_bent_valley_is_followed_to_its_end(x: float, y: float) -> None:
    found = minimise(Rosenbrock(), np.array([x, y]), tolerance=1e-12, most_steps=200)
    assert found.converged
    np.testing.assert_allclose(found.values, 1.0, atol=1e-5)


def test_running_out_of_steps_is_told() -> None:
    found = minimise(Rosenbrock(), np.array([-3.0, 3.0]), tolerance=1e-12, most_steps=2)
    assert not found.converged
    assert found.steps == 2
    assert found.expected > 1e-12


def test_the_inverse_holds_where_si_units_spread_over_fifteen_decades() -> None:
    rng = np.random.default_rng(4)
    factor = rng.standard_normal((6, 6))
    scale = 10.0 ** np.array([6, 6, 3, 0, -5, -9])
    normal = (factor @ factor.T + np.eye(6)) / np.outer(scale, scale)
    expected = np.linalg.inv(factor @ factor.T + np.eye(6)) * np.outer(scale, scale)
    np.testing.assert_allclose(inverse(normal) / np.outer(scale, scale), expected / np.outer(scale, scale), rtol=1e-9)
