"""The service's time of day: with the computer's clock, but never back."""

from datetime import UTC, datetime, timedelta

from hypothesis import given
from hypothesis import strategies as st

from api.service.monotonic_clock import MonotonicClock

MORNING = datetime(2026, 3, 4, 9, 30, tzinfo=UTC)
PASSES = st.lists(st.tuples(st.floats(0.0, 3_600.0), st.floats(-86_400.0, 86_400.0)), max_size=20)


class Computer:
    """Its clock is set by the test; how long it has run is not."""

    def __init__(self) -> None:
        self.wall, self.ran = MORNING, 50.0

    def steady_time(self) -> MonotonicClock:
        return MonotonicClock(lambda: self.wall, lambda: self.ran)

    def passes(self, seconds: float, set_by: float = 0.0) -> None:
        self.wall += timedelta(seconds=seconds + set_by)
        self.ran += seconds


def test_it_is_the_computers_clock_as_long_as_that_is_not_set() -> None:
    computer = Computer()
    now = computer.steady_time()
    for _ in range(5):
        computer.passes(7.0)
        assert now() == computer.wall


def test_it_follows_a_clock_that_is_set_forwards() -> None:
    computer = Computer()
    now = computer.steady_time()
    computer.passes(1.0, set_by=3_600.0)
    assert now() == computer.wall


def test_it_goes_on_where_the_clock_is_set_back() -> None:
    computer = Computer()
    now = computer.steady_time()
    computer.passes(1.0, set_by=-3_600.0)
    assert now() == MORNING + timedelta(seconds=1.0)
    computer.passes(2.0)
    assert now() == MORNING + timedelta(seconds=3.0)


@given(PASSES)
def test_time_passes_as_fast_as_it_does_and_never_goes_back(passes: list[tuple[float, float]]) -> None:
    computer = Computer()
    now = computer.steady_time()
    before = now()
    for seconds, set_by in passes:
        computer.passes(seconds, set_by)
        later = now()
        assert later - before >= timedelta(seconds=seconds) - timedelta(microseconds=2)
        assert later >= computer.wall
        before = later
