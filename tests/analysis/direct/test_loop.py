"""The loop of a sine point: closed, through the record, and of the area that the cycle dissipates."""

import numpy as np
import pytest

from analysis.direct.loop import POINTS, loop_of
from analysis.errors import AnalysisError

RATE, FREQUENCY, AMPLITUDE = 5_000.0, 40.3, 50e-6  # Hz, Hz, m
TIME = np.arange(10_000) / RATE
TURN = 2 * np.pi * FREQUENCY * TIME + 0.7


def test_an_ellipse_dissipates_pi_h_times_the_square_of_its_amplitude() -> None:
    k, gamma = 5e5, 0.2
    moved = 5e-4 + AMPLITUDE * np.cos(TURN)
    pushed = 150.0 + (k * (1 + 1j * gamma) * AMPLITUDE * np.exp(1j * TURN)).real
    found = loop_of(moved, pushed, RATE, FREQUENCY)
    assert found.dissipated == pytest.approx(np.pi * k * gamma * AMPLITUDE**2, rel=1e-6)
    assert found.displacement.shape == found.force.shape == (POINTS + 1,)
    assert (found.displacement[-1], found.force[-1]) == pytest.approx((found.displacement[0], found.force[0]))
    assert np.ptp(found.displacement) == pytest.approx(2 * AMPLITUDE, rel=0.01)


def test_the_loop_of_a_joint_that_stiffens_is_no_ellipse_and_goes_through_its_record() -> None:
    moved = AMPLITUDE * np.cos(TURN)
    pushed = 4e5 * moved + 2e13 * moved**3 - 1e4 * AMPLITUDE * np.sin(TURN)
    found = loop_of(moved, pushed, RATE, FREQUENCY)
    expected = 4e5 * found.displacement + 2e13 * found.displacement**3
    assert np.max(np.abs(found.force - expected)) == pytest.approx(1e4 * AMPLITUDE, rel=0.02)
    area = np.trapezoid(found.force, found.displacement)
    assert abs(area) == pytest.approx(found.dissipated, rel=0.01)


def test_a_record_without_a_cycle_has_no_loop() -> None:
    with pytest.raises(AnalysisError, match="constant"):
        loop_of(np.zeros(1_000), np.zeros(1_000), RATE, FREQUENCY)
