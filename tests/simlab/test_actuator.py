"""The tester's plant: bandwidth, droop, noise of an absolute size, and a truth that its signals agree with."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from simlab.actuator import Actuator, Complex, Real, Servo
from simlab.bench import Mounted

QUIET = Servo(cycle_noise=0.0, displacement_noise=0.0, force_noise=0.0)


class Rubber:
    """A specimen that softens with amplitude, in a tester whose clock the test turns."""

    def __init__(self, scale: float = 1.0) -> None:
        self.time = 0.0
        self.scale = scale
        self.mounted: Mounted | None = Mounted("I", "shear")

    def now(self) -> float:
        return self.time

    def dynamic_stiffness(self, amplitude: ArrayLike, frequency: float) -> Complex:
        return self.scale * 7e5 * (1 + 0.1j) * np.power(np.divide(amplitude, 5e-5), -0.25) * (1 + frequency / 2000)

    own_stiffness = dynamic_stiffness

    def static_force(self, preset: ArrayLike) -> Real:
        return self.scale * 4e5 * np.asarray(preset)

    def third_harmonic(self, amplitude: ArrayLike) -> Real:
        return np.full(np.shape(amplitude), 0.02)


def harmonics(signal: np.ndarray, times: np.ndarray, frequency: float, count: int = 3) -> np.ndarray:
    """Complex amplitudes of harmonics 0, 1, 2, ... of a record of whole cycles, x = Re(X e^(i w t))."""
    waves = np.exp(-2j * np.pi * frequency * np.outer(np.arange(count + 1), times))
    return np.asarray(2 * waves @ signal / times.size)


def cycling(
    amplitude_pp: float, frequency: float, servo: Servo = QUIET, seed: int = 0, scale: float = 1.0
) -> tuple[Rubber, Actuator]:
    rubber = Rubber(scale)
    actuator = Actuator(rubber, rubber.now, seed, servo)
    actuator.move(5e-4)
    rubber.time = 2.0
    actuator.cycle(amplitude_pp, frequency)
    rubber.time = 4.0
    return rubber, actuator


@pytest.mark.parametrize("frequency", [5.0, 55.0, 200.0])
def test_signals_hold_the_amplitude_and_stiffness_that_the_log_states(frequency: float) -> None:
    _, actuator = cycling(1e-4, frequency)
    times = 4.0 + np.arange(10_000) / 10_000
    displacement, force = actuator.signals(times)
    x, f = harmonics(displacement, times, frequency), harmonics(force, times, frequency)
    (dwell,) = actuator.log
    assert 2 * abs(x[1]) == pytest.approx(dwell.amplitude_pp, rel=1e-6)
    measured = f[1] / x[1]
    assert measured.real == pytest.approx(dwell.stiffness, rel=2e-4)
    assert measured.imag == pytest.approx(dwell.damping, rel=2e-4)
    assert abs(f[3] / f[1]) == pytest.approx(0.02, rel=1e-3)
    assert x[0].real / 2 == pytest.approx(5e-4, rel=1e-9)
    assert f[0].real / 2 == pytest.approx(4e5 * 5e-4, rel=1e-6)


def test_the_logged_stiffness_is_the_specimens_at_the_amplitude_reached() -> None:
    rubber, actuator = cycling(1e-4, 100.0)
    (dwell,) = actuator.log
    exact = rubber.dynamic_stiffness(dwell.amplitude_pp / 2, 100.0)
    assert complex(dwell.stiffness, dwell.damping) == pytest.approx(exact)


def test_amplitude_falls_with_frequency_and_with_the_specimens_stiffness() -> None:
    reached = [cycling(1e-4, frequency)[1].log[0].amplitude_pp for frequency in (5.0, 100.0, 200.0)]
    assert 1e-4 > reached[0] > reached[1] > reached[2] > 0.85e-4
    stiffer = cycling(1e-4, 100.0, scale=4.0)[1].log[0].amplitude_pp
    assert 0.9 * reached[1] < stiffer < 0.97 * reached[1]


def test_amplitude_approaches_its_steady_value_exponentially() -> None:
    _, actuator = cycling(1e-4, 100.0)
    steady = actuator.steady_pp()
    for constants in (1, 3):
        at = 2.0 + constants * actuator.servo.amplitude_time
        assert actuator.amplitude_pp(at) == pytest.approx(steady * (1 - np.exp(-constants)))


def test_the_preset_is_reached_with_limited_velocity() -> None:
    rubber = Rubber()
    actuator = Actuator(rubber, rubber.now, servo=QUIET)
    actuator.move(5e-4)
    assert actuator.mean(0.25) == pytest.approx(2.5e-4)
    assert actuator.is_ramping(0.25)
    assert actuator.mean(0.6) == 5e-4
    assert not actuator.is_ramping(0.6)


def test_hold_stops_a_ramp_where_it_is() -> None:
    rubber = Rubber()
    actuator = Actuator(rubber, rubber.now, servo=QUIET)
    actuator.move(5e-4)
    rubber.time = 0.25
    actuator.hold()
    assert actuator.mean(9.0) == pytest.approx(2.5e-4)


def test_a_day_of_commands_takes_no_more_memory_than_minutes_and_the_log_has_every_dwell() -> None:
    rubber, actuator = cycling(1e-4, 40.0)
    for _ in range(2000):
        rubber.time += 10.0
        actuator.cycle(1e-4, 40.0)
    times = np.linspace(rubber.time - 300.0, rubber.time, 500)
    before = actuator.signals(times)
    assert len(actuator._past[0]) == len(actuator._past[1]) < 300
    assert len(actuator.log) == 2001
    rubber.time += 1.0
    actuator.cycle(5e-5, 40.0)
    np.testing.assert_array_equal(actuator.signals(times), before)


def test_it_knows_when_its_command_leaves_it_at_rest() -> None:
    rubber, actuator = cycling(1e-4, 40.0)
    assert actuator.rests_since(1e-7) is None
    rubber.time += 5.0
    held = rubber.time
    actuator.hold()
    faded = actuator.rests_since(1e-7)
    assert faded is not None
    assert held < faded < held + 0.1
    assert actuator.amplitude_pp(faded) == pytest.approx(1e-7)
    rubber.time += 5.0
    actuator.hold()  # once more, at rest
    assert actuator.rests_since(1e-7) == faded
    actuator.move(1e-4)
    travelled = actuator.rests_since(1e-7)
    assert travelled is not None
    assert actuator.is_ramping(travelled - 1e-6)
    assert not actuator.is_ramping(travelled + 1e-6)


def test_hold_brings_a_cycling_actuator_to_rest_at_its_mean() -> None:
    _, actuator = cycling(1e-4, 100.0)
    actuator.hold()
    displacement, _ = actuator.signals(5.0 + np.arange(100) / 1000)
    assert np.allclose(displacement, 5e-4, atol=1e-12)


@given(st.floats(2.5, 40.0), st.floats(5.0, 200.0), st.floats(5.0, 200.0))
def test_displacement_never_jumps_when_the_frequency_changes(change: float, before: float, after: float) -> None:
    rubber, actuator = cycling(1e-4, before, Servo(displacement_noise=0.0))
    rubber.time = change
    actuator.cycle(1e-4, after)
    rubber.time = change + 1.0
    step = 1e-6
    displacement, _ = actuator.signals(np.asarray(change - 5e-6 + step * np.arange(11)))
    # no faster than the sine itself, with room for the cycle noise
    assert np.abs(np.diff(displacement)).max() < 1.2 * 2 * np.pi * max(before, after) * 5e-5 * step


def test_the_same_times_give_the_same_samples_however_they_are_asked_for() -> None:
    _, actuator = cycling(1e-4, 60.0, Servo())
    times = 1.5 + np.arange(5000) / 2000
    together = actuator.signals(times)
    apart = [actuator.signals(times[start : start + 500]) for start in range(0, 5000, 500)]
    assert np.array_equal(together[0], np.concatenate([part[0] for part in apart]))
    assert np.array_equal(together[1], np.concatenate([part[1] for part in apart]))


def test_another_seed_gives_other_noise_and_the_same_truth() -> None:
    times = 3.0 + np.arange(900) / 1000
    one, other = cycling(1e-4, 60.0, Servo(), seed=1)[1], cycling(1e-4, 60.0, Servo(), seed=2)[1]
    assert one.log == other.log
    assert not np.array_equal(one.signals(times)[0], other.signals(times)[0])


def test_cycle_noise_is_absolute_so_that_the_smallest_amplitude_is_the_machines_limit() -> None:
    scatter = {}
    for amplitude_pp in (1e-4, 1e-5):
        _, actuator = cycling(amplitude_pp, 200.0, Servo())
        cycles = actuator.latest_cycles_pp(4.0, 300)
        scatter[amplitude_pp] = cycles.std() / cycles.mean()
    assert scatter[1e-4] < 0.004
    assert 0.015 < scatter[1e-5] < 0.05
    assert scatter[1e-5] == pytest.approx(10 * scatter[1e-4], rel=0.3)


def test_cycles_are_counted_from_the_command_and_none_is_reported_before_it_is_complete() -> None:
    _, actuator = cycling(1e-4, 10.0)
    actuator.cycle(5e-5, 20.0)
    assert actuator.latest_cycles_pp(4.01, 16).size == 0
    assert actuator.cycles_since_command(4.26) == 5
    assert actuator.latest_cycles_pp(4.26, 16).size == 5
    assert actuator.latest_cycles_pp(9.0, 16).size == 16


def test_sensor_noise_is_white_and_of_the_stated_size() -> None:
    rubber = Rubber()
    actuator = Actuator(rubber, rubber.now)
    displacement, force = actuator.signals(np.arange(20_000) / 51_200)
    for signal, rms in ((displacement, Servo().displacement_noise), (force, Servo().force_noise)):
        assert signal.std() == pytest.approx(rms, rel=0.03)
        assert abs(np.corrcoef(signal[:-1], signal[1:])[0, 1]) < 0.03
    assert abs(np.corrcoef(displacement, force)[0, 1]) < 0.03


def test_an_empty_tester_moves_without_force() -> None:
    rubber = Rubber()
    rubber.mounted = None
    actuator = Actuator(rubber, rubber.now, servo=QUIET)
    actuator.cycle(1e-4, 50.0)
    displacement, force = actuator.signals(1.0 + np.arange(100) / 1000)
    assert np.ptp(displacement) > 9e-5
    assert not force.any()
    assert actuator.log == ()
