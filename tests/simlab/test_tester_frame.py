"""What the tester adds: the machine finds the specimen in series with the frame, with the fixture's mass, and late."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from simlab.actuator import Actuator, Servo
from simlab.bench import Mounted, ordinary_bench
from simlab.clock import Clock
from simlab.ordinary import BenchConditions
from simlab.tester_frame import PIECES, Complex, KnownPiece, Real, TesterFrame
from tests.simlab.specimens import stiffness_of

FRAME = TesterFrame(compliance=3e-8, fixture_mass=0.15, delay=150e-6)
OMEGA = 2 * math.pi * 100.0


def softening(amplitude: Real) -> Complex:
    return np.asarray(2e6 * (1 + 0.1j) * (amplitude / 1e-5) ** -0.3)


@given(
    st.floats(0.0, 5e-8),
    st.floats(0.0, 0.5),
    arrays(np.float64, 3, elements=st.floats(1e-6, 1e-4)),
    st.floats(5.0, 200.0),
)
def test_specimen_and_frame_share_the_motion(compliance: float, mass: float, amplitude: Real, frequency: float) -> None:
    frame = TesterFrame(compliance, mass)
    seen, own = frame.specimen_share(softening, amplitude, frequency)
    assert np.array_equal(own, softening(seen))
    sprung = own - (2 * math.pi * frequency) ** 2 * mass
    force = sprung * seen
    assert abs(seen + compliance * force) == pytest.approx(amplitude, rel=1e-4)
    assert frame.in_series(own, frequency) == pytest.approx(sprung / (1 + compliance * sprung))


def test_a_tester_that_adds_nothing_changes_nothing() -> None:
    rigid = TesterFrame()
    amplitude, stiffness = np.array([1e-5]), np.array([2e6 + 1e5j])
    assert rigid.specimen_share(softening, amplitude, 50.0) == (amplitude, softening(amplitude))
    assert rigid.in_series(stiffness, 50.0) == stiffness
    assert rigid.static_force(lambda x: 1e6 * x, np.array([5e-4])) == 500.0


def test_the_preset_is_shared_too() -> None:
    force = FRAME.static_force(lambda x: 1e6 * x, np.array([5e-4]))
    assert force == pytest.approx(5e-4 / (1 / 1e6 + FRAME.compliance), rel=1e-6)


def test_known_pieces_are_mounted_as_blanks() -> None:
    bench = ordinary_bench(1, Clock(), BenchConditions(frame=FRAME))
    for name, piece in PIECES.items():
        bench.mount(name, "blank")
        assert bench.mounted == Mounted(name, "blank")
        assert bench.own_stiffness(5e-6, 100.0) == piece.stiffness - OMEGA**2 * piece.mass
        sprung = bench.own_stiffness(5e-6, 100.0) - OMEGA**2 * FRAME.fixture_mass
        assert bench.dynamic_stiffness(5e-6, 100.0) == pytest.approx(1 / (1 / sprung + FRAME.compliance))
        assert bench.third_harmonic(5e-6) == 0.0
    with pytest.raises(ValueError, match="no piece 'brick' to calibrate by; there are blank, empty, mass"):
        bench.mount("brick", "blank")


def test_a_specimen_s_own_stiffness_is_the_truth_of_a_dwell() -> None:
    bench = ordinary_bench(1, Clock(), BenchConditions(frame=FRAME))
    bench.mount("I", "compression")
    actuator = Actuator(bench, bench.clock.now, servo=Servo(cycle_noise=0.0))
    actuator.cycle(5e-5, 100.0)
    (dwell,) = actuator.log
    seen = (
        dwell.amplitude_pp / 2 / abs(1 + FRAME.compliance * (complex(dwell.stiffness, dwell.damping) - OMEGA**2 * 0.15))
    )
    own = stiffness_of(bench.built, "I", "compression", seen, 100.0, bench.temperature(0.0))
    assert complex(dwell.stiffness, dwell.damping) == pytest.approx(complex(own), rel=1e-4)


class Sine:
    def signals(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return 1e-5 * np.sin(OMEGA * times), np.sin(OMEGA * times)


def test_the_displacement_comes_late() -> None:
    bench = ordinary_bench(1, Clock(), BenchConditions(frame=FRAME))
    bench.attach_actuator(Sine())
    times = np.linspace(1.0, 1.1, 50)
    signals = bench.tester_signals(times)
    np.testing.assert_allclose(signals["displacement"], 1e-5 * np.sin(OMEGA * (times - FRAME.delay)), rtol=1e-9)
    np.testing.assert_array_equal(signals["force"], np.sin(OMEGA * times))


def test_a_piece_without_stiffness_or_mass_is_the_empty_tester() -> None:
    assert KnownPiece().dynamic_stiffness(100.0) == 0
