from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.errors import AnalysisError
from analysis.suspended.rayleigh import rayleigh_damping

OMEGA = 2 * np.pi * np.array([160.0, 439.0, 856.0])


@given(alpha=st.floats(0.1, 20), beta=st.floats(1e-8, 1e-5), share=st.floats(1e-4, 0.05))
def test_rayleigh_damping_is_found_and_described(alpha: float, beta: float, share: float) -> None:
    ratios = alpha / (2 * OMEGA) + beta * OMEGA / 2
    found = rayleigh_damping(OMEGA, ratios, np.diag((share * ratios) ** 2))
    assert found.mass_factor.value == pytest.approx(alpha, rel=1e-6)
    assert found.stiffness_factor.value == pytest.approx(beta, rel=1e-6)
    assert found.describes is True
    assert found.worst_share < 1e-6
    assert "describes the damping" in found.text


def test_the_standard_errors_are_the_scatter_of_repeated_fits() -> None:
    truth = 5.0 / (2 * OMEGA) + 1e-6 * OMEGA / 2
    covariance = np.outer(0.02 * truth, 0.02 * truth) * (0.7 * np.eye(3) + 0.3)
    noise = np.random.default_rng(5).multivariate_normal(np.zeros(3), covariance, size=2000)
    fits = [rayleigh_damping(OMEGA, truth + each, covariance) for each in noise]
    for name in ("mass_factor", "stiffness_factor"):
        scatter = np.std([getattr(fit, name).value for fit in fits])
        assert getattr(fits[0], name).standard_error == pytest.approx(scatter, rel=0.05)
    assert np.mean([fit.chi_square for fit in fits]) == pytest.approx(1, abs=0.1)
    assert np.mean([fit.describes is True for fit in fits]) > 0.98


def test_the_damping_printed_in_table_1_is_not_rayleighs_if_it_is_known_to_a_few_per_cent() -> None:
    ratios = np.array([0.004, 0.001, 0.001])
    found = rayleigh_damping(OMEGA, ratios, np.diag((0.05 * ratios) ** 2))
    assert found.describes is False
    assert "does not describe" in found.text
    assert "mode by mode" in found.text


def test_neither_factor_is_negative() -> None:
    falling_too_fast = np.array([0.004, 0.0005, 0.0001])
    found = rayleigh_damping(OMEGA, falling_too_fast, np.diag([1e-8, 1e-8, 1e-8]))
    assert found.stiffness_factor.value == 0
    assert found.mass_factor.value > 0


def test_two_modes_leave_the_question_open() -> None:
    found = rayleigh_damping(OMEGA[:2], np.array([0.004, 0.001]), np.diag([1e-10, 1e-10]))
    assert found.describes is None
    assert "a third would tell" in found.text


def test_one_mode_is_refused() -> None:
    with pytest.raises(AnalysisError, match="measure two or more"):
        rayleigh_damping(OMEGA[:1], np.array([0.004]), np.array([[1e-10]]))
