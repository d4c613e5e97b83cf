"""FairLock: one thread at a time, in the order in which they asked, and none waits longer than its timeout."""

import threading

import pytest

from rig.fair_lock import FairLock
from tests.waiting import LONG, until


def wait_until_waiting(lock: FairLock, count: int) -> None:
    until(lambda: len(lock._waiting) >= count)


def test_the_thread_that_has_waited_longest_goes_next() -> None:
    lock, served = FairLock(), list[int]()

    def ask(number: int) -> None:
        with lock:
            served.append(number)

    lock.acquire()
    threads = [threading.Thread(target=ask, args=(number,)) for number in range(5)]
    for number, thread in enumerate(threads):
        thread.start()
        wait_until_waiting(lock, number + 1)
    lock.release()
    for thread in threads:
        thread.join(LONG)
    assert served == [0, 1, 2, 3, 4]


def test_a_thread_that_polls_lets_another_in() -> None:
    lock, came_in = FairLock(), threading.Event()

    def beat() -> None:
        with lock:
            came_in.set()

    lock.acquire()
    waiting = threading.Thread(target=beat)
    waiting.start()
    wait_until_waiting(lock, 1)
    lock.release()
    lock.acquire()  # at once, as a loop does
    assert came_in.is_set()
    lock.release()
    waiting.join(LONG)


def test_a_thread_whose_timeout_is_over_is_not_called_any_more() -> None:
    lock = FairLock()
    assert lock.acquire()
    assert not lock.acquire(0.01)
    assert not lock.acquire(-1.0)
    lock.release()
    assert lock.acquire(0.0)


def test_an_interrupted_wait_keeps_no_thread_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    class Interrupted(threading.Event):
        def wait(self, timeout: float | None = None) -> bool:
            raise KeyboardInterrupt

    lock = FairLock()
    lock.acquire()
    monkeypatch.setattr("rig.fair_lock.threading.Event", Interrupted)
    with pytest.raises(KeyboardInterrupt):
        lock.acquire()
    monkeypatch.undo()
    lock.release()
    assert lock.acquire(0.0)


def test_however_many_ask_one_has_it_at_a_time_and_none_is_forgotten() -> None:
    lock, inside, most, done = FairLock(), [0], [0], [0]

    def work(number: int) -> None:
        for _ in range(100):
            if lock.acquire(0.0005 * (number % 3) if number else LONG):
                inside[0] += 1
                most[0] = max(most[0], inside[0])
                done[0] += 1
                inside[0] -= 1
                lock.release()

    threads = [threading.Thread(target=work, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(LONG)
    assert not any(thread.is_alive() for thread in threads)
    assert most == [1]
    assert done[0] >= 100
    assert lock.acquire(0.0)
