"""FairLock at one line: one at a time, in the order of asking, and nobody waits longer than they wanted to."""

from __future__ import annotations

import threading
import time

import pytest

from rig.fair_lock import FairLock

SOON = 10.0  # s, for what happens at once


def wait_until_waiting(turns: FairLock, count: int) -> None:
    ends = time.monotonic() + SOON
    while len(turns._waiting) < count:
        assert time.monotonic() < ends
        time.sleep(0.001)


def test_whoever_has_waited_longest_goes_next() -> None:
    turns, served = FairLock(), list[int]()

    def ask(number: int) -> None:
        with turns:
            served.append(number)

    turns.take()
    threads = [threading.Thread(target=ask, args=(number,)) for number in range(5)]
    for number, thread in enumerate(threads):
        thread.start()
        wait_until_waiting(turns, number + 1)
    turns.give_back()
    for thread in threads:
        thread.join(SOON)
    assert served == [0, 1, 2, 3, 4]


def test_one_that_polls_lets_another_in_at_its_next_turn() -> None:
    turns, came_in = FairLock(), threading.Event()

    def beat() -> None:
        with turns:
            came_in.set()

    turns.take()
    waiting = threading.Thread(target=beat)
    waiting.start()
    wait_until_waiting(turns, 1)
    turns.give_back()
    turns.take()  # at once, as a loop does
    assert came_in.is_set()
    turns.give_back()
    waiting.join(SOON)


def test_who_gives_up_waiting_is_not_called_any_more() -> None:
    turns = FairLock()
    assert turns.take()
    assert not turns.take(0.01)
    assert not turns.take(-1.0)
    turns.give_back()
    assert turns.take(0.0)


def test_a_wait_that_is_interrupted_keeps_nobody_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    class Interrupted(threading.Event):
        def wait(self, timeout: float | None = None) -> bool:
            raise KeyboardInterrupt

    turns = FairLock()
    turns.take()
    monkeypatch.setattr("rig.fair_lock.threading.Event", Interrupted)
    with pytest.raises(KeyboardInterrupt):
        turns.take()
    monkeypatch.undo()
    turns.give_back()
    assert turns.take(0.0)


def test_however_many_ask_one_has_it_at_a_time_and_none_is_forgotten() -> None:
    turns, inside, most, done = FairLock(), [0], [0], [0]

    def work(number: int) -> None:
        for _ in range(100):
            if turns.take(0.0005 * (number % 3) if number else SOON):
                inside[0] += 1
                most[0] = max(most[0], inside[0])
                done[0] += 1
                inside[0] -= 1
                turns.give_back()

    threads = [threading.Thread(target=work, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(SOON)
    assert not any(thread.is_alive() for thread in threads)
    assert most == [1]
    assert done[0] >= 100
    assert turns.take(0.0)
