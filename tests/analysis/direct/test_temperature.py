import math
from dataclasses import astuple, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.direct.point_covariance import joint_covariance
from analysis.direct.temperature import TemperatureCoefficients, at_reference_temperature
from analysis.errors import AnalysisError
from analysis.interval import Estimate
from tests.analysis.direct.points import from_polar

COMPOUND = TemperatureCoefficients(Estimate(-0.003, 0.001), Estimate(-0.004, 0.002))
POINT = from_polar(50.0, 1e-5, 2e6, 0.12, 0.001)


@given(warmer=st.floats(-10, 10), alpha=st.floats(-0.02, 0.02), beta=st.floats(-0.02, 0.02))
def test_a_specimen_that_follows_the_law_comes_back_to_its_reference(warmer: float, alpha: float, beta: float) -> None:
    k, gamma = POINT.stiffness * (1 + alpha * warmer), POINT.loss_factor * (1 + beta * warmer)
    warm = replace(POINT, complex_stiffness=complex(k, k * gamma))
    exact = TemperatureCoefficients(Estimate(alpha, 0.0), Estimate(beta, 0.0))
    (found,) = at_reference_temperature([warm], [23.0 + warmer], 23.0, exact)
    assert found.complex_stiffness == pytest.approx(POINT.complex_stiffness, rel=1e-12)


def test_what_the_coefficients_are_not_known_to_is_common_to_all_points() -> None:
    one, other = at_reference_temperature([POINT, POINT], [28.0, 18.0], 23.0, COMPOUND)
    expected = math.hypot(5 * 0.001 / (1 - 5 * 0.003), 0.001)
    assert one.stiffness_estimate.standard_error / one.stiffness == pytest.approx(expected, rel=1e-2)
    covariance = joint_covariance([one, other])
    # five degrees too warm and five too cold err in opposite ways
    correlation = covariance[0, 2] / math.sqrt(covariance[0, 0] * covariance[2, 2])
    assert correlation == pytest.approx(-0.96, abs=0.02)


def test_the_thermometers_error_counts_even_at_the_reference() -> None:
    (found,) = at_reference_temperature([POINT], [23.0], 23.0, COMPOUND, thermometer_error=1.0)
    assert found.complex_stiffness == POINT.complex_stiffness
    added = found.covariance[0, 0] - POINT.covariance[0, 0]
    assert math.sqrt(added) == pytest.approx(0.003 * POINT.stiffness, rel=1e-6)


def test_what_was_applied_is_recorded() -> None:
    (found,) = at_reference_temperature([POINT], [26.0], 23.0, COMPOUND)
    assert [astuple(record) for record in found.corrections] == [
        ("temperature_shift", "delta_t", -3.0, 0.0, "K"),
        ("temperature_shift", "alpha", -0.003, 0.001, "1/K"),
        ("temperature_shift", "beta", -0.004, 0.002, "1/K"),
    ]


def test_the_covariance_stays_one() -> None:
    (found,) = at_reference_temperature([POINT], [33.0], 23.0, COMPOUND, 0.5)
    assert np.all(np.linalg.eigvalsh(found.covariance) > 0)


def test_a_temperature_beyond_the_reach_of_the_coefficients_is_refused() -> None:
    with pytest.raises(AnalysisError, match="further than 10 K"):
        at_reference_temperature([POINT], [35.0], 23.0, COMPOUND)


def test_points_without_a_temperature_are_refused() -> None:
    with pytest.raises(AnalysisError, match="give one a point"):
        at_reference_temperature([POINT], [], 23.0, COMPOUND)


@pytest.mark.parametrize(
    ("alpha", "beta", "said"),
    [
        (-0.3, -0.004, r"alpha of -0.3 1/K.*at 28 degrees Celsius"),  # -0.3 % written as -0.3
        (-0.003, -0.2, r"beta of -0.2 1/K.*at 28 degrees Celsius"),
        (0.2, 0.0, r"alpha of 0.2 1/K.*at 18 degrees Celsius"),
        (math.nan, 0.0, r"alpha of nan 1/K"),
        (0.0, math.inf, r"beta of inf 1/K"),
    ],
)
def test_a_coefficient_that_leaves_no_stiffness_or_loss_is_refused(alpha: float, beta: float, said: str) -> None:
    impossible = TemperatureCoefficients(Estimate(alpha, 0.0), Estimate(beta, 0.0))
    with pytest.raises(AnalysisError, match=said):
        at_reference_temperature([POINT, POINT], [28.0, 18.0], 23.0, impossible)


@pytest.mark.parametrize("error", [-0.1, math.nan, math.inf])
def test_an_error_that_is_none_is_refused(error: float) -> None:
    with pytest.raises(AnalysisError, match=rf"standard error of the thermometer is {error}"):
        at_reference_temperature([POINT], [28.0], 23.0, COMPOUND, error)
    wrong = replace(COMPOUND, stiffness=Estimate(-0.003, error))
    with pytest.raises(AnalysisError, match=rf"standard error of alpha is {error}"):
        at_reference_temperature([POINT], [28.0], 23.0, wrong)
