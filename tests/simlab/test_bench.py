import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from simlab.bench import Mounted, SimulatedBench, ordinary_bench
from simlab.clock import Clock
from simlab.elastomer import BLOW_AMPLITUDE, REFERENCE_TEMPERATURE
from simlab.ordinary import BenchConditions
from tests.simlab.specimens import stiffness_of

QUIET = BenchConditions(
    double_hits=0, tolerances=0, scatter=0, gain_error=0, force_noise=0, acceleration_noise=0, cross_axis=0
)


def bench(conditions: BenchConditions | None = None, seed: int = 1) -> SimulatedBench:
    return ordinary_bench(seed, Clock(), conditions)


def test_a_noiseless_clean_blow_shows_the_exact_accelerance() -> None:
    quiet = bench(QUIET)
    quiet.strike(8, "y", at=1.00003, what="clean")
    signals = quiet.hammer_signals(0.9, 5120.0, 15360)
    frequency = np.asarray(np.fft.rfftfreq(15360, 1 / 5120.0), dtype=np.float64)
    lines = (frequency >= 20.0) & (frequency <= 1024.0)
    force, acceleration = (np.fft.rfft(signals[name])[lines] for name in ("hammer", "accelerometer"))
    exact = quiet.accelerance(frequency[lines], 8, "y", temperature=quiet.temperature(1.0))
    np.testing.assert_allclose(acceleration / force, exact, rtol=1e-3, atol=1e-5 * np.abs(exact).max())


def test_ten_blows_give_accelerances_with_a_noise_of_one_to_three_thousandths() -> None:
    noisy = bench(BenchConditions(double_hits=0, tolerances=0, scatter=0, gain_error=0, cross_axis=0))
    cross, power = np.zeros(5121, dtype=complex), np.zeros(5121)
    for number in range(10):
        noisy.strike(3, "y", at=1.0 + 4 * number)
        signals = noisy.hammer_signals(0.9 + 4 * number, 5120.0, 10240)
        force, acceleration = np.fft.rfft(signals["hammer"]), np.fft.rfft(signals["accelerometer"])
        cross += acceleration * force.conj()
        power += np.abs(force) ** 2
    frequency = np.asarray(np.fft.rfftfreq(10240, 1 / 5120.0), dtype=np.float64)
    middle = (frequency > 400.0) & (frequency < 600.0)
    exact = noisy.accelerance(frequency[middle], 3, "y", temperature=noisy.temperature(20.0))
    error = np.sqrt(np.mean(np.abs((cross / power)[middle] - exact) ** 2))
    assert 0.001 < error < 0.003


def test_the_same_seed_and_strikes_give_the_same_signals_however_they_are_read() -> None:
    one, other = bench(seed=7), bench(seed=7)
    for each in (one, other):
        each.strike(5, "y", at=1.0)
        each.strike(11, "x", at=1.5)
    whole = one.hammer_signals(0.8, 5120.0, 10240)
    with ThreadPoolExecutor(4) as threads:
        parts = list(
            threads.map(lambda begin: other.hammer_signals(0.8 + begin / 5120.0, 5120.0, 1024), range(0, 10240, 1024))
        )
    for name, signal in whole.items():
        np.testing.assert_allclose(np.hstack([part[name] for part in parts]), signal, atol=1e-9)
    assert one.blows == other.blows


def test_another_seed_is_another_bench() -> None:
    signals = []
    for seed in (1, 2):
        each = bench(seed=seed)
        each.strike(5, "y", at=1.0)
        signals.append(each.hammer_signals(0.9, 5120.0, 2048)["accelerometer"])
    assert np.abs(signals[0] - signals[1]).max() > 0.01 * np.abs(signals[0]).max()


def test_gains_are_off_by_no_more_than_stated_and_multiply_the_signals() -> None:
    off = bench(BenchConditions(double_hits=0, scatter=0, force_noise=0, acceleration_noise=0))
    exact = bench(BenchConditions(double_hits=0, scatter=0, force_noise=0, acceleration_noise=0, gain_error=0))
    for each in (off, exact):
        each.strike(4, "y", at=1.0)
    signals = [each.hammer_signals(0.9, 5120.0, 4096) for each in (off, exact)]
    for name in ("hammer", "accelerometer"):
        assert 0 < abs(off.gains[name] - 1) <= 0.005
        assert exact.gains[name] == 1.0
        np.testing.assert_allclose(signals[0][name], off.gains[name] * signals[1][name])


def test_the_trigger_fires_on_the_rising_flank_of_each_blow_in_turn() -> None:
    ready = bench(QUIET)
    assert ready.next_crossing("hammer", 5.0, 0.0) is None
    ready.strike(3, "y", at=2.0, what="double")
    ready.strike(3, "y", at=1.0)
    first = ready.next_crossing("hammer", 5.0, 0.0)
    assert first is not None
    assert 1.0 - 0.6e-3 < first < 1.0
    assert float(ready.blows[1].force(first)) == pytest.approx(5.0, rel=1e-6)
    second = ready.next_crossing("hammer", 50.0, 1.0)
    assert second is not None
    assert second == pytest.approx(2.0, abs=0.6e-3)
    assert ready.next_crossing("hammer", 50.0, 2.0) is None
    signals = ready.hammer_signals(0.9, 51200.0, 12000)
    sampled = 0.9 + np.argmax(signals["hammer"] > 5.0) / 51200.0
    assert 0 <= sampled - first < 1.01 / 51200.0


def test_a_blow_that_leans_first_fires_the_trigger_long_before_its_peak() -> None:
    ready = bench(QUIET)
    ready.strike(3, "y", at=2.0, what="late")
    crossing = ready.next_crossing("hammer", 5.0, 0.0)
    assert crossing is not None
    assert 0.03 < 2.0 - crossing < 0.12
    assert ready.next_crossing("hammer", 5.0, 2.0) is None


def test_a_trigger_level_in_the_noise_or_on_another_channel_is_refused() -> None:
    with pytest.raises(ValueError, match="noise"):
        bench().next_crossing("hammer", 0.05, 0.0)
    with pytest.raises(ValueError, match="accelerometer"):
        bench().next_crossing("accelerometer", 5.0, 0.0)


def test_a_strike_without_a_time_comes_in_a_moment() -> None:
    ready = bench()
    before = ready.clock.now()
    ready.strike(6, "y")
    assert before + 0.2 < ready.blows[0].pulses[0].time < ready.clock.now() + 0.4


def test_strikes_that_cannot_be_are_refused_and_leave_no_blow() -> None:
    ready = bench()
    for strike, words in (((2, "y", 1.0), "no hammer reaches 2y"), ((3, "y", 1.0, "gentle"), "gentle")):
        with pytest.raises(ValueError, match=words):
            ready.strike(*strike)
    with pytest.raises(ValueError, match="positive"):
        ready.strike(3, "y", 1.0, peak_force=0.0)
    assert ready.blows == ()


def test_the_tester_holds_what_was_mounted() -> None:
    ready = bench()
    assert ready.mounted is None
    with pytest.raises(ValueError, match="empty"):
        ready.dynamic_stiffness(5e-6, 100.0)
    ready.mount("II", "shear")
    assert ready.mounted == Mounted("II", "shear")
    exact = complex(stiffness_of(ready.built, "II", "shear", 5e-6, 100.0))
    assert ready.dynamic_stiffness(5e-6, 100.0) == pytest.approx(exact, rel=3e-3)  # today's temperature
    static = stiffness_of(ready.built, "II", "shear", 5e-4, 0.0).real
    assert ready.static_force(5e-4) == pytest.approx(static * 5e-4 * (1 + 60.0 * 5e-4))  # it locks up slowly
    assert ready.third_harmonic(5e-6) == pytest.approx(0.6 * 0.007 * 0.1**0.85)
    with pytest.raises(ValueError, match="no configuration"):
        ready.mount("I", "torsion")
    assert ready.mounted == Mounted("II", "shear")


class Ramp:
    def signals(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return 1e-3 * times, 2.0 * times


def test_the_tester_signals_are_those_of_the_actuator_attached() -> None:
    ready = bench()
    times = np.linspace(0.0, 1.0, 5)
    assert not any(signal.any() for signal in ready.tester_signals(times).values())
    ready.attach_actuator(Ramp())
    signals = ready.tester_signals(times)
    np.testing.assert_array_equal(signals["displacement"], 1e-3 * times)
    np.testing.assert_array_equal(signals["force"], 2.0 * times)


def test_the_room_stays_near_23_degrees_and_drifts_slowly() -> None:
    for seed in range(10):
        ready = bench(seed=seed)
        course = np.array([ready.temperature(t) for t in np.linspace(0.0, 36_000.0, 600)])
        assert np.abs(course - REFERENCE_TEMPERATURE).max() < 0.5
        assert np.ptp(course) > 0.2
        assert np.abs(np.diff(course)).max() < 0.1


def test_the_truth_is_json_and_says_what_the_joints_are() -> None:
    ready = bench()
    truth = json.loads(json.dumps(ready.truth()))
    for name, joint in ready.built.article.joints.items():
        stated = truth["inverse"][name]
        exact = joint.dynamic_stiffness(BLOW_AMPLITUDE, 300.0)[0]
        np.testing.assert_allclose(stated["k"], exact.real, rtol=2e-3)
        np.testing.assert_allclose(stated["h"], exact.imag, rtol=2e-3, atol=0.1)
        assert np.all(np.array(stated["k_spread"]) < 0.01 * np.abs(stated["k"]).max())
        assert stated["gamma"][1][1] == pytest.approx(stated["h"][1][1] / stated["k"][1][1])
        assert stated["gamma"][0][2] is None
    points = truth["direct"]["I"]["angled"]["0.05"]
    assert points["frequency_hz"] == [5.0 * n for n in range(1, 41)]
    exact_point = stiffness_of(ready.built, "I", "angled", 25e-6, 100.0)
    assert complex(points["k"][19], points["h"][19]) == pytest.approx(complex(exact_point))
    assert len(truth["modes"]["frequency_hz"]) == len(truth["modes"]["loss_factor"]) == 6


def test_a_harder_hammer_softens_the_joints_in_the_truth_and_in_the_response() -> None:
    normal, hard = (bench(BenchConditions(peak_force=force, tolerances=0)).truth() for force in (100.0, 400.0))
    assert hard["inverse"]["I"]["k"][1][1] < 0.95 * normal["inverse"]["I"]["k"][1][1]
    assert hard["modes"]["frequency_hz"][0] < normal["modes"]["frequency_hz"][0]
    quiet = bench(QUIET)
    frequency = np.linspace(60.0, 300.0, 200)
    soft, stiff = (np.abs(quiet.accelerance(frequency, 3, "y", peak_force=force)) for force in (400.0, 100.0))
    assert frequency[np.argmax(soft)] < frequency[np.argmax(stiff)]
