"""Force and acceleration of a rigid mass: its mass, the polarity, and what swapped cables make of it."""

import numpy as np
import pytest

from analysis.chain import apparent_mass, mass_if_swapped
from analysis.errors import AnalysisError

TIMES = np.arange(5120) / 5120.0
BLOW = 100.0 * np.exp(-(((TIMES - 0.5) / 1e-3) ** 2))
NOISE = 0.02 * np.random.default_rng(1).standard_normal((2, TIMES.size))


@pytest.mark.parametrize("sign", [1, -1])
def test_force_over_acceleration_is_the_mass_with_the_sign_of_the_polarity(sign: int) -> None:
    found = apparent_mass(BLOW + NOISE[0], sign * BLOW / 3.0 + NOISE[1])
    assert found.mass == pytest.approx(sign * 3.0, rel=1e-3)
    assert found.correlation == pytest.approx(sign, abs=1e-3)
    assert found.peak_force == pytest.approx(100.0, rel=0.05)


def test_swapped_cables_show_the_mass_that_is_foretold() -> None:
    force, acceleration = 2.25e-3, 10.2e-3
    volts_of_hammer, volts_of_accelerometer = force * BLOW, acceleration * BLOW / 3.0
    found = apparent_mass(volts_of_accelerometer / force, volts_of_hammer / acceleration)
    assert found.mass == pytest.approx(mass_if_swapped(3.0, force, acceleration), rel=1e-6)


def test_noise_alone_is_not_taken_for_a_blow() -> None:
    assert abs(apparent_mass(NOISE[0], NOISE[1]).correlation) < 0.5


def test_a_channel_that_stands_still_is_refused() -> None:
    with pytest.raises(AnalysisError, match="no blow"):
        apparent_mass(BLOW, np.zeros(BLOW.size))
