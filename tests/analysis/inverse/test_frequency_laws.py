"""Laws of frequency: constant where they say so, causal, with the derivatives that the fit needs."""

import numpy as np
import pytest

from analysis.frequency_response import Complex, Real
from analysis.inverse.frequency_laws import CORNER, FARTHEST, REFERENCE_FREQUENCY, growth, growth_slopes, zener_like

ZENER = np.array([[0.0], [0.5], [0.7], [0.3]])
POWER = np.array([[0.08], [0.0], [0.0], [0.0]])
LOGARITHM: Complex = np.log(np.array([20.0, 80.0, 300.0, 1000.0]) / 100.0 + 0.03j)  # under an exponential window


def test_a_joint_without_exponent_and_rise_is_constant_exactly() -> None:
    anywhere = np.array([[0.0], [0.0], [1.3], [-0.8]])
    np.testing.assert_array_equal(growth(anywhere, LOGARITHM), np.ones((1, 4)))


@pytest.mark.parametrize("law", [POWER, ZENER, POWER + ZENER])
def test_derivatives_are_those_of_the_logarithm(law: Real) -> None:
    def logarithm(values: Real) -> Complex:
        return np.asarray(np.log(growth(values, LOGARITHM)))

    found, step = growth_slopes(law, LOGARITHM), 1e-5
    for parameter in range(4):
        by = step * np.eye(4)[:, parameter : parameter + 1]
        difference = (logarithm(law + by) - logarithm(law - by)) / (2 * step)
        assert found[parameter] == pytest.approx(difference, abs=1e-8)


@pytest.mark.parametrize("law", [POWER, ZENER, POWER + ZENER])
def test_stiffness_and_loss_are_tied_by_causality(law: Real) -> None:
    """Kramers-Kronig: the part of the loss angle that follows frequency is the integral over the slope of ln |z|.

    H. W. Bode, Network Analysis and Feedback Amplifier Design, 1945, Section 14.2: with u = ln (x / f), the angle at f
    is the integral of d ln |z| / du ln coth |u / 2| du over pi.
    """
    u = np.linspace(-60.0, 60.0, 2_000_001)[1::2]  # beside the pole of the weight at 0
    weight = -np.log(np.tanh(np.abs(u) / 2)) / np.pi
    asked = np.array([30.0, REFERENCE_FREQUENCY, 400.0])
    angles = []
    for frequency in asked:
        size = np.log(np.abs(growth(law, np.asarray(u + np.log(frequency / REFERENCE_FREQUENCY), dtype=complex))[0]))
        angles.append(np.trapezoid(np.gradient(size, u) * weight, u))
    own = np.angle(growth(law, np.log(asked / REFERENCE_FREQUENCY).astype(complex))[0])
    assert own - own[1] == pytest.approx(np.array(angles) - angles[1], abs=2e-4)


def test_a_zener_law_for_a_power_is_as_steep_and_can_be_started_from_for_any_power() -> None:
    around: Complex = np.log(np.array([0.99, 1.01]) * CORNER / REFERENCE_FREQUENCY).astype(complex)
    steep = np.log(np.abs(growth(zener_like(np.array([0.02])), around)[0]))
    assert np.diff(steep)[0] / np.log(1.01 / 0.99) == pytest.approx(0.02, rel=0.05)
    assert np.max(np.abs(zener_like(np.array([3.0, -3.0])))) < FARTHEST
