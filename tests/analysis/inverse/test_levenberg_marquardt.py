import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis.errors import AnalysisError
from analysis.inverse.levenberg_marquardt import NOWHERE, Linearised, Trial, inverse, inverse_of_squares, minimise

Real = NDArray[np.float64]


class Rosenbrock:
    """The bent valley 100 (y - x^2)^2 + (1 - x)^2, with its minimum of zero at (1, 1)."""

    data = 2

    def at(self, values: Real) -> Trial:
        residual = self.residual(values)
        jacobian = np.array([[-20 * values[0], 10.0], [-1.0, 0.0]])
        cost = float(residual @ residual)
        return Trial(cost, lambda: Linearised(cost, jacobian.T @ residual, jacobian.T @ jacobian))

    def residual(self, values: Real) -> Real:
        x, y = values
        return np.array([10 * (x**2 - y), x - 1])


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


class Creeping:
    """A sum of squares of 1000 of which each step, always half as long as it should be, takes less than the last."""

    data = 2

    def at(self, values: Real) -> Trial:
        cost = 1000.0 + float(values @ values)
        return Trial(cost, lambda: Linearised(cost, -values, 2 * np.eye(1)))


def test_steps_that_gain_too_little_of_what_is_left_are_the_last() -> None:
    start = np.array([20.0])
    crept, whole = (minimise(Creeping(), start, tolerance=1e-9, least_gain=share) for share in (0.01, 0.0))
    assert whole.converged
    assert not crept.converged
    assert 2 < crept.steps < whole.steps
    assert crept.at.cost < 1010.0


def test_no_step_gains_too_little_where_nothing_is_left_beyond_noise() -> None:
    start = np.array([-1.0, 1.0])
    found, whole = (minimise(Rosenbrock(), start, tolerance=1e-12, least_gain=share) for share in (0.01, 0.0))
    assert found.converged
    assert found.steps == whole.steps


class Narrow(Rosenbrock):
    """A valley a hundred times as narrow, along which only steps that are hardly damped get on."""

    def at(self, values: Real) -> Trial:
        x, y = values
        residual = np.array([1e3 * (x**2 - y), x - 1])
        jacobian = np.array([[-2e3 * x, 1e3], [-1.0, 0.0]])
        cost = float(residual @ residual)
        return Trial(cost, lambda: Linearised(cost, jacobian.T @ residual, jacobian.T @ jacobian))


def test_damping_that_was_a_little_too_small_is_raised_a_little() -> None:
    found = minimise(Narrow(), np.array([0.5, 0.25]), tolerance=1e-6, most_steps=150)
    assert found.converged


def test_steps_that_bend_with_a_valley_get_to_its_end_in_fewer() -> None:
    bent = minimise(Narrow(), np.array([-1.0, 1.0]), tolerance=1e-6, most_steps=100, along_valleys=True)
    straight = minimise(Narrow(), np.array([-1.0, 1.0]), tolerance=1e-6, most_steps=100)
    assert bent.converged
    assert not straight.converged
    np.testing.assert_allclose(bent.values, 1.0, atol=1e-3)


def test_a_direction_below_rounding_is_no_minimum_and_has_a_variance() -> None:
    class Flat(Rosenbrock):
        def at(self, values: Real) -> Trial:
            normal = np.array([[1.0, 1.0 + 1e-15], [1.0 + 1e-15, 1.0]])
            return Trial(1.0, lambda: Linearised(1.0, np.array([1.0, -1.0]), normal))

    assert not minimise(Flat(), np.zeros(2), most_steps=3).converged
    assert np.all(np.diag(inverse(Flat().at(np.zeros(2)).linearised().normal)) > 1e10)


def test_parameters_that_cannot_be_told_apart_share_a_step() -> None:
    class Twins(Rosenbrock):
        def at(self, values: Real) -> Trial:
            left = float(np.sum(values)) - 3.0
            normal = np.ones((2, 2))
            return Trial(left**2, lambda: Linearised(left**2, -left * np.ones(2), normal))

    found = minimise(Twins(), np.zeros(2))
    assert found.converged
    np.testing.assert_allclose(found.values, [1.5, 1.5], rtol=1e-3)


class Fenced(Rosenbrock):
    """The same valley, of which the part left of a fence does not exist; derivatives are counted."""

    def __init__(self) -> None:
        self.slopes = 0

    def at(self, values: Real) -> Trial:
        if values[0] < 0:
            return NOWHERE
        trial = super().at(values)

        def counted() -> Linearised:
            self.slopes += 1
            return trial.linearised()

        return Trial(trial.cost, counted)


def test_derivatives_are_asked_for_only_where_a_step_was_taken() -> None:
    fenced = Fenced()
    found = minimise(fenced, np.array([0.1, 3.0]), tolerance=1e-12, most_steps=200)
    assert found.converged
    assert fenced.slopes == found.steps + 1


def test_a_search_cannot_begin_where_there_is_nothing() -> None:
    with pytest.raises(AnalysisError, match="choose another start"):
        minimise(Fenced(), np.array([-1.0, 0.0]))


def test_the_inverse_holds_where_si_units_spread_over_fifteen_decades() -> None:
    rng = np.random.default_rng(4)
    factor = rng.standard_normal((6, 6))
    scale = 10.0 ** np.array([6, 6, 3, 0, -5, -9])
    normal = (factor @ factor.T + np.eye(6)) / np.outer(scale, scale)
    expected = np.linalg.inv(factor @ factor.T + np.eye(6)) * np.outer(scale, scale)
    np.testing.assert_allclose(inverse(normal) / np.outer(scale, scale), expected / np.outer(scale, scale), rtol=1e-9)


def test_rows_keep_what_their_squares_lose() -> None:
    known, hardly_known = 1e12, 1.0
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    rows = np.diag([known, hardly_known]) @ turn
    expected = turn.T @ np.diag([known**-2, hardly_known**-2]) @ turn
    np.testing.assert_allclose(inverse_of_squares(rows), expected, rtol=1e-3)
    assert np.max(np.abs(inverse(rows.T @ rows) / expected - 1)) > 0.5
