"""Token buckets: each caller has its own."""

from api.service.floods import MOST_CALLERS, TokenBuckets


def test_a_caller_has_so_many_at_once_and_then_so_many_a_second() -> None:
    now = 0.0
    buckets = TokenBuckets(3, 2, lambda: now)
    assert [buckets.take("ann") for _ in range(5)] == [True, True, True, False, False]
    now = 1.0
    assert [buckets.take("ann") for _ in range(3)] == [True, True, False]
    now = 1000.0
    assert [buckets.take("ann") for _ in range(5)] == [True, True, True, False, False]


def test_one_caller_takes_nothing_from_another() -> None:
    buckets = TokenBuckets(1, 1, lambda: 0.0)
    assert [buckets.take("stranger") for _ in range(10)].count(True) == 1
    assert buckets.take("ann")


def test_callers_without_end_take_no_memory_without_end() -> None:
    buckets = TokenBuckets(1, 1, lambda: 0.0)
    for number in range(3 * MOST_CALLERS):
        buckets.take(str(number))
    assert buckets.callers == MOST_CALLERS
