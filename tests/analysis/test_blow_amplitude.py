from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import TransferFunction, lsim

from analysis.blow_amplitude import BlowForce, joint_amplitudes_pp
from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.modes import Modes
from analysis.structure.forward import eigensolution

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

DOFS = tuple(map(Dof.parse, ("2x", "2y", "3y")))
POINT = Dof.parse("3y")
RATE = 50e3


def half_sine(peak: float, width: float) -> Real:
    length = 1.5 * width
    time = np.arange(round(length * RATE)) / RATE
    return np.asarray(peak * np.sin(np.pi * time / length))


def modes(frequencies: list[float], loss_factors: list[float], shapes: list[list[complex]]) -> Modes:
    omega = 2 * np.pi * np.array(frequencies)
    poles = np.asarray(1j * omega * np.sqrt(1 + 1j * np.array(loss_factors)), dtype=np.complex128)
    return Modes(poles, np.array(shapes, dtype=complex), DOFS)


ONE = modes([80.0], [0.05], [[0.0, 0.4, 0.5]])
TWO = modes([80.0, 260.0], [0.05, 0.06], [[0.3, 0.4, 0.5], [0.2, -0.5, 0.4]])


def test_a_single_modes_amplitude_is_where_it_starts_over_the_root_of_e() -> None:
    (found,) = joint_amplitudes_pp(ONE, {"I": 2}, [BlowForce(POINT, np.array([0.03]))])["I"]
    start = 0.4 * 0.5 * 0.03 / abs(ONE.poles[0])
    assert found == pytest.approx(2 * start / math.sqrt(math.e), rel=1e-3)


def test_a_struck_oscillator_starts_at_the_amplitude_computed() -> None:
    """One freedom, m = 6.25 kg, integrated in time without the modal model."""
    mass, omega, damping = 6.25, 2 * math.pi * 80, 0.025
    oscillator = modes([80.0], [2 * damping], [[0.0, mass**-0.5, mass**-0.5]])
    force = np.concatenate([half_sine(100.0, 0.3e-3), np.zeros(round(0.02 * RATE))])
    time = np.arange(force.size) / RATE
    _, moved, _ = lsim(TransferFunction([1 / mass], [1, 2 * damping * omega, omega**2]), force, time)
    blow = BlowForce.from_record(POINT, force, RATE, oscillator)
    (found,) = joint_amplitudes_pp(oscillator, {"I": 2}, [blow])["I"]
    quarter = math.exp(-damping * math.pi / 2)  # of a cycle later, at the first peak
    assert 2 * np.max(moved) == pytest.approx(found * math.sqrt(math.e) * quarter, rel=0.01)


@pytest.mark.parametrize("width", [0.2e-3, 0.6e-3, 2e-3])
def test_a_half_sine_of_known_peak_has_the_spectrum_of_its_record(width: float) -> None:
    by_record = BlowForce.from_record(POINT, half_sine(100.0, width), RATE, TWO).impulse
    by_peak = BlowForce.from_peak(POINT, 100.0, width, TWO).impulse
    np.testing.assert_allclose(by_peak, by_record, rtol=0.01)


def test_where_the_spectrum_of_a_half_sine_is_nought_over_nought_it_is_its_limit() -> None:
    length = 1 / 160.0  # half a cycle of the mode
    blow = BlowForce.from_peak(POINT, 100.0, length / 1.5, modes([80.0], [0.0], [[0, 0.4, 0.5]]))
    assert blow.impulse[0] == pytest.approx(100 * length / 2)


@settings(max_examples=30, deadline=None)
@given(force=st.floats(1e-3, 1e3), scale=st.floats(0.1, 10))
def test_amplitudes_are_proportional_to_force_and_blows_of_equal_force_average(force: float, scale: float) -> None:
    one, other = BlowForce(POINT, np.array([0.03, 0.02])), BlowForce(POINT, force * np.array([0.03, 0.02]))
    plain, stronger = (joint_amplitudes_pp(TWO, {"I": 2}, [blow])["I"] for blow in (one, other))
    np.testing.assert_allclose(stronger, force * plain, rtol=1e-9)
    np.testing.assert_allclose(joint_amplitudes_pp(TWO, {"I": 2}, [other, other])["I"], stronger, rtol=1e-9)


def test_a_mode_that_the_blow_hardly_moves_sees_the_amplitude_of_the_others() -> None:
    weak = BlowForce(POINT, np.array([0.03, 1e-6]))
    first, second = joint_amplitudes_pp(TWO, {"I": 2}, [weak])["I"]
    start = 2 * math.hypot(0.3, 0.4) * 0.5 * 0.03 / abs(TWO.poles[0])
    assert first == pytest.approx(start / math.sqrt(math.e), rel=1e-3)
    # it dies out earlier, so it sees more of the beginning
    assert first < second < start


def test_blows_of_the_hammer_move_the_benchs_joints_by_a_few_micrometres(bench: Bench) -> None:
    found = eigensolution(bench.free_beam, bench.joints, 1000.0)
    points = [Dof.parse(text) for text in ("1y", "3y", "5y", "7y", "9y", "11y", "1x", "11x")]
    blows = [BlowForce.from_peak(point, 100.0, 0.3e-3, found) for point in points]
    for amplitudes in joint_amplitudes_pp(found, {"I": 2, "II": 10}, blows).values():
        assert np.all((amplitudes > 2e-6) & (amplitudes < 2e-5))


def test_what_cannot_be_computed_is_refused_with_the_reason() -> None:
    with pytest.raises(AnalysisError, match="no blow"):
        joint_amplitudes_pp(ONE, {"I": 2}, [])
    with pytest.raises(AnalysisError, match="no component 5x"):
        joint_amplitudes_pp(ONE, {"I": 5}, [BlowForce(POINT, np.array([0.03]))])
    with pytest.raises(AnalysisError, match="does not decay"):
        joint_amplitudes_pp(replace(ONE, poles=-ONE.poles.conj()), {"I": 2}, [BlowForce(POINT, np.array([0.03]))])
    with pytest.raises(AnalysisError, match="both have to be positive"):
        BlowForce.from_peak(POINT, -1.0, 1e-3, ONE)
    with pytest.raises(AnalysisError, match="finite"):
        BlowForce.from_record(POINT, [math.nan], RATE, ONE)
