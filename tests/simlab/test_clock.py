import time

import pytest

from simlab.clock import Clock


def test_bench_time_runs_speed_times_as_fast_as_the_wall() -> None:
    before = time.monotonic()
    clock = Clock(speed=1000.0)
    made = time.monotonic()
    time.sleep(0.01)
    earliest = time.monotonic()
    shown = clock.now()
    latest = time.monotonic()
    assert 1000.0 * (earliest - made) <= shown <= 1000.0 * (latest - before)


def test_sleeping_ends_at_the_bench_time_asked_for_and_takes_its_share_of_the_wall() -> None:
    clock = Clock(speed=50.0)
    started = time.monotonic()
    wake = clock.now() + 1.0
    clock.sleep_until(wake)
    assert clock.now() >= wake
    assert time.monotonic() - started >= 0.9 * clock.wall(1.0)


def test_sleeping_until_a_time_that_has_passed_returns_at_once() -> None:
    clock = Clock(speed=0.001)
    started = time.monotonic()
    clock.sleep_until(-1.0)
    clock.sleep(-5.0)
    assert time.monotonic() - started < 100.0  # of 1,000 s and 5,000 s


def test_a_bench_duration_is_shorter_on_the_wall_of_a_fast_clock() -> None:
    assert Clock(speed=20.0).wall(3.0) == pytest.approx(0.15)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("inf"), float("nan")])
def test_a_clock_that_stands_runs_back_or_has_no_speed_is_refused(speed: float) -> None:
    with pytest.raises(ValueError, match="speed"):
        Clock(speed)
