"""A worker is given up when it is silent, and never because some clock was set."""

from datetime import UTC, datetime, timedelta

from hypothesis import given
from hypothesis import strategies as st

from jointlab.jobs.queue import StaleWorkers
from store.service.jobs import LEASE, SignOfLife

MORNING = datetime(2026, 3, 4, 9, 30, tzinfo=UTC)
LEASE_SECONDS = LEASE.total_seconds()
SECONDS = st.floats(0.1, 0.99 * LEASE_SECONDS)
STEPS = st.sampled_from([-86_400.0, -3_600.0, -LEASE_SECONDS, 0.0, LEASE_SECONDS, 3_600.0, 86_400.0])


class Clock:
    """A clock that the test turns."""

    def __init__(self) -> None:
        self.now = 1_000.0

    def __call__(self) -> float:
        return self.now


@given(st.lists(st.tuples(SECONDS, STEPS), min_size=1, max_size=30))
def test_a_worker_that_beats_is_never_given_up_however_its_clock_is_set(beats: list[tuple[float, float]]) -> None:
    clock, says = Clock(), MORNING
    silence = StaleWorkers(clock)
    for number, (seconds, step) in enumerate(beats):
        sign = SignOfLife(1, "token", says + timedelta(microseconds=number))
        assert silence.lasting([sign]) == []
        clock.now += seconds
        assert silence.lasting([sign]) == []
        says += timedelta(seconds=seconds + step)


@given(STEPS)
def test_a_worker_that_is_silent_is_given_up_after_a_lease_whatever_time_it_said(wrong_by: float) -> None:
    clock = Clock()
    silence = StaleWorkers(clock)
    dead = SignOfLife(1, "dead", MORNING + timedelta(seconds=wrong_by))
    for second in range(int(LEASE_SECONDS) + 1):
        alive = SignOfLife(2, "alive", MORNING + timedelta(seconds=second))
        assert silence.lasting([dead, alive]) == []
        clock.now += 1.0
    assert silence.lasting([dead, SignOfLife(2, "alive", MORNING)]) == [dead]
    assert silence.lasting([SignOfLife(1, "taken again", None)]) == []


@given(st.floats(LEASE_SECONDS, 1e6))
def test_a_worker_is_not_given_up_because_the_store_was_away(away: float) -> None:
    """Neither it nor the queue reached the store: at the first look afterwards it had no time for a sign of life."""
    clock = Clock()
    silence = StaleWorkers(clock)
    sign = SignOfLife(1, "token", MORNING)
    assert silence.lasting([sign]) == []
    clock.now += away
    assert silence.lasting([sign]) == []
    clock.now += 1.0
    beats = SignOfLife(1, "token", MORNING + timedelta(seconds=away))
    assert silence.lasting([beats]) == []
    for _ in range(int(LEASE_SECONDS) + 1):
        clock.now += 1.0
        silent = silence.lasting([beats])
    assert silent == [beats]


def test_a_worker_that_is_silent_is_given_up_however_seldom_it_is_looked_at() -> None:
    clock = Clock()
    silence = StaleWorkers(clock)
    sign = SignOfLife(1, "token", MORNING)
    looks = [silence.lasting([sign])]
    for _ in range(4):
        clock.now += 3600.0
        looks.append(silence.lasting([sign]))
    assert looks[-1] == [sign]
