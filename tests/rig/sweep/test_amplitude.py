"""Reaching an amplitude: settled is judged from cycles, and the target is approached from below."""

from collections.abc import Callable, Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.registers import CYCLES_REPORTED
from rig.sweep.amplitude import FEWEST_CYCLES, AmplitudeControl, cycle_noise, is_steady
from rig.tester import driver as tester
from rig.tester import limits as tester_limits
from simlab import tester_server
from simlab.bench import ordinary_bench
from simlab.clock import Clock

Commanded = Callable[[float, float, float], list[float]]


def test_noise_of_a_cycle_is_that_of_independent_cycles_and_not_of_a_slow_trend() -> None:
    noisy = (1.0, -1.0) * 8
    assert cycle_noise(tuple(10 + cycle for cycle in noisy)) == pytest.approx(2**0.5)
    assert cycle_noise(tuple(10 + 0.01 * i for i in range(16))) == pytest.approx(0.01 / 2**0.5)


@given(st.integers(FEWEST_CYCLES, CYCLES_REPORTED), st.floats(1e-6, 1e-3))
def test_equal_cycles_are_steady_as_soon_as_there_are_enough(count: int, amplitude_pp: float) -> None:
    assert is_steady((amplitude_pp,) * count, 0.02)
    assert not is_steady((amplitude_pp,) * (FEWEST_CYCLES - 1), 0.02)


@given(st.integers(FEWEST_CYCLES, CYCLES_REPORTED), st.floats(0.2, 3.0))
def test_an_amplitude_that_still_rises_by_more_than_the_tolerance_is_not_steady(count: int, rise: float) -> None:
    # latest first, so the first is the largest
    assert not is_steady(tuple(1.0 + rise * (count - i) / count for i in range(count)), 0.02)


def test_noisy_cycles_are_steady_only_when_their_mean_is_known_or_there_are_no_more() -> None:
    noisy = tuple(1.0 + (0.03 if i % 2 else -0.03) for i in range(CYCLES_REPORTED))
    assert not is_steady(noisy[:8], 0.02)
    assert is_steady(noisy, 0.02)
    assert is_steady(noisy[:8], 0.2)


@pytest.fixture
def server() -> Iterator[tester_server.TesterServer]:
    bench = ordinary_bench(5, Clock(speed=200.0))
    bench.mount("II", "compression")
    server = tester_server.start_tester_server(bench)
    yield server
    server.stop()


@pytest.fixture
def driver(server: tester_server.TesterServer) -> Iterator[tester.Tester]:
    limits = tester_limits.TesterLimits(amplitude_pp=1.3e-4)
    with tester.connect(server.url, limits) as driver:
        driver.start()
        driver.preset(5e-4)
        yield driver


@pytest.fixture
def commanded(driver: tester.Tester, server: tester_server.TesterServer) -> Commanded:
    """What one control commands, one approach after another, in m peak to peak."""
    control = AmplitudeControl(driver)

    def approach(target_pp: float, frequency: float, tolerance: float) -> list[float]:
        before = len(server.actuator.log)
        control.approach(target_pp, frequency, tolerance)
        return [dwell.commanded_pp for dwell in server.actuator.log[before:]]

    return approach


@pytest.mark.parametrize(("target_pp", "tolerance"), [(1e-4, 0.02), (5e-5, 0.02), (1e-5, 0.05)])
def test_the_amplitude_is_reached_and_never_passed_by_more_than_the_tolerance(
    driver: tester.Tester, server: tester_server.TesterServer, target_pp: float, tolerance: float
) -> None:
    control = AmplitudeControl(driver)
    for frequency in (150.0, 155.0, 160.0):
        control.approach(target_pp, frequency, tolerance)
        assert server.actuator.log[-1].amplitude_pp == pytest.approx(target_pp, rel=tolerance)
    assert max(dwell.amplitude_pp for dwell in server.actuator.log) < target_pp * (1 + tolerance)


def test_the_gain_of_a_neighbouring_frequency_saves_the_approach(commanded: Commanded) -> None:
    first, *others = commanded(1e-4, 100.0, 0.02)
    assert first == pytest.approx(0.7e-4)
    assert others
    assert len(commanded(1e-4, 102.0, 0.02)) == 1
    assert commanded(1e-4, 10.0, 0.02)[0] == pytest.approx(0.7e-4)  # no neighbour: from below again


def test_a_larger_target_at_a_known_frequency_is_approached_from_below_again(commanded: Commanded) -> None:
    commanded(1e-5, 100.0, 0.05)
    assert commanded(1e-4, 100.0, 0.02)[0] == pytest.approx(0.7e-4)
    assert len(commanded(1e-5, 100.0, 0.05)) == 1


def test_a_target_beyond_the_limits_is_approached_up_to_the_limit(
    driver: tester.Tester, server: tester_server.TesterServer
) -> None:
    server.faults.set("weak_servo")
    reached = AmplitudeControl(driver).approach(1e-4, 50.0, 0.02)
    assert reached.commanded_pp == 1.3e-4
    assert reached.amplitude_pp == pytest.approx(1.3e-4 / 3, rel=0.15)
