import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.direct.constitutive import LawParameter, dynamic_stiffness
from analysis.frequency_response import Real

PARAMETERS = np.log([0.8e6, 1.3, 0.06, 0.2, 2e-5, 0.55, 0.3, 0.8, 1e-2, 0.4])
spread = st.lists(st.floats(-0.7, 0.7), min_size=10, max_size=10)


def at(logarithms: Real, amplitude: float, frequency: float) -> complex:
    return complex(dynamic_stiffness(logarithms, np.array([amplitude]), np.array([frequency]), 50.0)[0][0])


@given(change=spread, amplitude=st.floats(1e-6, 1e-3), frequency=st.floats(0.1, 1e3))
def test_the_derivatives_are_those_of_the_law(change: list[float], amplitude: float, frequency: float) -> None:
    logarithms = PARAMETERS + change
    _, slopes = dynamic_stiffness(logarithms, np.array([amplitude]), np.array([frequency]), 50.0)
    size = abs(at(logarithms, amplitude, frequency))
    for parameter in LawParameter:
        step = np.zeros(10)
        step[parameter] = 1e-5
        ahead, behind = (at(logarithms + sign * step, amplitude, frequency) for sign in (1, -1))
        assert slopes[0, parameter] == pytest.approx((ahead - behind) / 2e-5, abs=1e-6 * size)


@given(change=spread, amplitude=st.floats(1e-6, 1e-3), frequency=st.floats(0.1, 1e3))
def test_a_filled_rubber_softens_with_amplitude_and_stiffens_with_frequency(
    change: list[float], amplitude: float, frequency: float
) -> None:
    logarithms = PARAMETERS + change
    here = at(logarithms, amplitude, frequency)
    assert here.imag > 0
    assert abs(at(logarithms, amplitude, 2 * frequency)) >= abs(here)
    no_loss = logarithms.copy()
    no_loss[[LawParameter.LOSS_FLOOR, LawParameter.LOSS_PEAK]] = -40
    assert at(no_loss, 2 * amplitude, frequency).real <= at(no_loss, amplitude, frequency).real


def test_at_the_reference_frequency_the_limits_of_amplitude_are_kraus_own() -> None:
    no_relaxation = PARAMETERS.copy()
    no_relaxation[LawParameter.RELAXATION] = -40
    k_inf, network, floor, peak = np.exp(PARAMETERS[:4])
    assert at(no_relaxation, 1e3, 50.0) == pytest.approx(k_inf * (1 + 1j * floor), rel=1e-3)
    assert at(no_relaxation, 1e-15, 50.0) == pytest.approx(k_inf * (1 + network + 1j * floor), rel=1e-3)
    halfway = at(no_relaxation, float(np.exp(PARAMETERS[LawParameter.AMPLITUDE])), 50.0)
    assert halfway == pytest.approx(k_inf * (1 + network / 2 + 1j * (floor + peak)))


@given(frequency=st.floats(0.5, 500))
def test_relaxation_is_causal(frequency: float) -> None:
    """Kramers and Kronig: nearly, the loss of a slow relaxation is pi / 2 of how stiffness rises with ln w."""
    weak = PARAMETERS.copy()
    weak[[LawParameter.LOSS_FLOOR, LawParameter.LOSS_PEAK]] = -40
    weak[LawParameter.ORDER] = np.log(0.1)
    rise = (at(weak, 1e-5, 1.01 * frequency).real - at(weak, 1e-5, frequency / 1.01).real) / (2 * np.log(1.01))
    assert at(weak, 1e-5, frequency).imag == pytest.approx(np.pi / 2 * rise, rel=0.05)
