from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import TransferFunction, lsim

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.joint_amplitude import BlowForce, JointAmplitude, joint_amplitudes, sine_amplitudes
from analysis.modes import Modes
from analysis.structure.forward import accelerance, eigensolution

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


def amplitudes(found: Modes, *blows: BlowForce) -> JointAmplitude:
    return joint_amplitudes(found, {"I": 2}, blows)["I"]


def error_of(found: JointAmplitude) -> Real:
    assert found.log_error is not None
    return found.log_error


def test_a_single_modes_amplitude_is_where_it_starts_over_the_root_of_e() -> None:
    (found,) = amplitudes(ONE, BlowForce(POINT, np.array([0.03]))).amplitude_pp
    start = 0.4 * 0.5 * 0.03 / abs(ONE.poles[0])
    assert found == pytest.approx(2 * start / math.sqrt(math.e), rel=1e-3)


def test_a_struck_oscillator_starts_at_the_amplitude_computed() -> None:
    """One freedom, m = 6.25 kg, integrated in time without the modal model."""
    mass, omega, damping = 6.25, 2 * math.pi * 80, 0.025
    oscillator = modes([80.0], [2 * damping], [[0.0, mass**-0.5, mass**-0.5]])
    force = np.concatenate([half_sine(100.0, 0.3e-3), np.zeros(round(0.02 * RATE))])
    time = np.arange(force.size) / RATE
    _, moved, _ = lsim(TransferFunction([1 / mass], [1, 2 * damping * omega, omega**2]), force, time)
    (found,) = amplitudes(oscillator, *BlowForce.from_records(POINT, force[None], RATE, oscillator)).amplitude_pp
    quarter = math.exp(-damping * math.pi / 2)  # of a cycle later, at the first peak
    assert 2 * np.max(moved) == pytest.approx(found * math.sqrt(math.e) * quarter, rel=0.01)


@pytest.mark.parametrize("width", [0.2e-3, 0.6e-3, 2e-3])
def test_a_half_sine_of_known_peak_has_the_spectrum_of_its_record(width: float) -> None:
    record = half_sine(100.0, width)
    one, twice = BlowForce.from_records(POINT, np.stack([record, 2 * record]), RATE, TWO)
    by_peak = BlowForce.from_peak(POINT, 100.0, width, TWO).impulse
    np.testing.assert_allclose(by_peak, one.impulse, rtol=0.01)
    np.testing.assert_allclose(twice.impulse, 2 * one.impulse)


def test_where_the_spectrum_of_a_half_sine_is_nought_over_nought_it_is_its_limit() -> None:
    length = 1 / 160.0  # half a cycle of the mode
    blow = BlowForce.from_peak(POINT, 100.0, length / 1.5, modes([80.0], [0.0], [[0, 0.4, 0.5]]))
    assert blow.impulse[0] == pytest.approx(100 * length / 2)


@settings(max_examples=30, deadline=None)
@given(force=st.floats(1e-3, 1e3), scale=st.floats(0.1, 10))
def test_amplitudes_are_proportional_to_force_and_blows_of_equal_force_average(force: float, scale: float) -> None:
    one, other = BlowForce(POINT, np.array([0.03, 0.02])), BlowForce(POINT, force * np.array([0.03, 0.02]))
    plain, stronger = (amplitudes(TWO, blow).amplitude_pp for blow in (one, other))
    np.testing.assert_allclose(stronger, force * plain, rtol=1e-9)
    np.testing.assert_allclose(amplitudes(TWO, other, other).amplitude_pp, stronger, rtol=1e-9)


def test_a_mode_that_the_blow_hardly_moves_sees_the_amplitude_of_the_others() -> None:
    weak = BlowForce(POINT, np.array([0.03, 1e-6]))
    first, second = amplitudes(TWO, weak).amplitude_pp
    start = 2 * math.hypot(0.3, 0.4) * 0.5 * 0.03 / abs(TWO.poles[0])
    assert first == pytest.approx(start / math.sqrt(math.e), rel=1e-3)
    # it dies out earlier, so it sees more of the beginning
    assert first < second < start


def test_blows_of_the_hammer_move_the_benchs_joints_by_a_few_micrometres(bench: Bench) -> None:
    found = eigensolution(bench.free_beam, bench.joints, 1000.0)
    points = [Dof.parse(text) for text in ("1y", "3y", "5y", "7y", "9y", "11y", "1x", "11x")]
    blows = [BlowForce.from_peak(point, 100.0, 0.3e-3, found) for point in points]
    for joint in joint_amplitudes(found, {"I": 2, "II": 10}, blows).values():
        assert np.all((joint.amplitude_pp > 2e-6) & (joint.amplitude_pp < 2e-5))


def test_blows_of_one_strength_have_no_scatter_and_a_single_one_tells_none() -> None:
    blow = BlowForce(POINT, np.array([0.03, 0.02]))
    np.testing.assert_allclose(error_of(amplitudes(TWO, blow, blow, blow)), 0, atol=1e-12)
    alone = amplitudes(TWO, blow)
    assert (alone.log_error, alone.ci95) == (None, None)


@settings(max_examples=30, deadline=None)
@given(scale=st.floats(0.01, 100), seed=st.integers(0, 99))
def test_the_scatter_is_relative_and_does_not_know_how_hard_the_hammer_is(scale: float, seed: int) -> None:
    strength = np.exp(0.2 * np.random.default_rng(seed).standard_normal(6))
    plain, scaled = (
        amplitudes(TWO, *(BlowForce(POINT, factor * each * np.array([0.03, 0.02])) for each in strength))
        for factor in (1.0, scale)
    )
    np.testing.assert_allclose(error_of(scaled), error_of(plain), rtol=1e-6)
    np.testing.assert_allclose(scaled.amplitude_pp, scale * plain.amplitude_pp, rtol=1e-9)


def test_intervals_cover_the_mean_of_many_blows_as_often_as_they_say() -> None:
    """A hand whose blows scatter by a tenth, at one point and thirty blows a session."""
    rng = np.random.default_rng(8)

    def session(blows: int) -> JointAmplitude:
        strength = np.exp(0.1 * rng.standard_normal((blows, 1)) + 0.02 * rng.standard_normal((blows, 2)))
        return amplitudes(TWO, *(BlowForce(POINT, each * np.array([0.03, 0.02])) for each in strength))

    truth = session(20_000).amplitude_pp
    hits = np.zeros(2)
    for _ in range(300):
        interval = session(30).ci95
        assert interval is not None
        hits += (interval[:, 0] <= truth) & (truth <= interval[:, 1])
    # 300 draws know 95 % to 1.3 %
    assert np.all(hits / 300 > 0.91), hits


def test_over_all_modes_it_is_the_mean_of_logarithms_with_an_error_that_is_not_averaged_down() -> None:
    found = JointAmplitude(np.array([1e-6, 4e-6]), np.array([0.02, 0.04]), 29, "by a test").over_modes
    assert found.amplitude_pp == pytest.approx([2e-6])
    assert found.log_error == pytest.approx([0.03])
    assert found.source == "by a test"


def test_what_cannot_be_computed_is_refused_with_the_reason() -> None:
    with pytest.raises(AnalysisError, match="no blow"):
        joint_amplitudes(ONE, {"I": 2}, [])
    with pytest.raises(AnalysisError, match="no component 5x"):
        joint_amplitudes(ONE, {"I": 5}, [BlowForce(POINT, np.array([0.03]))])
    with pytest.raises(AnalysisError, match="does not decay"):
        joint_amplitudes(replace(ONE, poles=-ONE.poles.conj()), {"I": 2}, [BlowForce(POINT, np.array([0.03]))])
    with pytest.raises(AnalysisError, match="both have to be positive"):
        BlowForce.from_peak(POINT, -1.0, 1e-3, ONE)
    with pytest.raises(AnalysisError, match="finite"):
        BlowForce.from_records(POINT, [[math.nan]], RATE, ONE)
    with pytest.raises(AnalysisError, match=r"\(blows, samples\)"):
        BlowForce.from_records(POINT, [1.0, 2.0], RATE, ONE)


SHAKER = Dof.parse("5y")
NODES = {"I": 2, "II": 10}


def test_it_is_what_the_joint_moves_by_at_each_mode(bench: Bench) -> None:
    modes = eigensolution(bench.free_beam, bench.joints, 3000.0)
    found = sine_amplitudes(modes, NODES, SHAKER, 2.0)
    for name, node in NODES.items():
        ways = [Dof.parse(f"{node}{way}") for way in "xy"]
        exact = [accelerance(bench.free_beam, bench.joints, modes.frequency, way, [SHAKER]) for way in ways]
        moved = np.linalg.norm([each.accelerance[0] for each in exact], axis=0) / (2 * np.pi * modes.frequency) ** 2
        np.testing.assert_allclose(found[name].amplitude_pp[:6], 2 * 2.0 * moved[:6], rtol=0.02)
        assert found[name].ci95 is None


def test_twice_the_force_moves_twice_as_far(bench: Bench) -> None:
    modes = eigensolution(bench.free_beam, bench.joints, 1500.0)
    once, twice = (sine_amplitudes(modes, NODES, SHAKER, force)["I"].amplitude_pp for force in (1.0, 2.0))
    np.testing.assert_allclose(twice, 2 * once)


def test_without_force_or_decay_there_is_no_amplitude(bench: Bench) -> None:
    modes = eigensolution(bench.free_beam, bench.joints, 1500.0)
    with pytest.raises(AnalysisError, match="a sine of 0 N"):
        sine_amplitudes(modes, NODES, SHAKER, 0.0)
    with pytest.raises(AnalysisError, match="does not decay"):
        sine_amplitudes(replace(modes, poles=-modes.poles.conj()), NODES, SHAKER, 1.0)
