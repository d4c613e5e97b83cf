"""The journal: a follower gets every event once, in order, from any thread."""

import asyncio
import threading
from collections.abc import Coroutine
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from analysis.dof import Direction, Dof
from jointlab.drive.journal import Journal
from rig.events import BlowAccepted, WaitStarted
from tests.waiting import LONG

Heard = TypeVar("Heard")


def in_a_loop_of_its_own(heard: Coroutine[Any, Any, Heard]) -> Heard:
    """What a coroutine returns; a browser of another test may have left a loop running in this thread."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, heard).result()


async def heard(journal: Journal, after: int, until: int) -> list[int]:
    numbers = []
    async for entry in journal.follow(after):
        numbers.append(entry.number)
        if entry.number == until:
            break
    return numbers


def test_followers_hear_of_everything_that_other_threads_tell() -> None:
    journal, events = Journal(), 400

    def tell(times: int) -> None:
        for _ in range(times):
            journal(WaitStarted(1.0))

    async def follow_while_others_tell() -> list[list[int]]:
        followers = [asyncio.create_task(heard(journal, 0, events)) for _ in range(3)]
        await asyncio.sleep(0)
        threads = [threading.Thread(target=tell, args=(events // 4,)) for _ in range(4)]
        for thread in threads:
            thread.start()
        return await asyncio.gather(*followers)

    assert in_a_loop_of_its_own(follow_while_others_tell()) == [list(range(1, events + 1))] * 3


def test_a_follower_goes_on_after_the_last_event_seen() -> None:
    journal = Journal()
    for _ in range(5):
        journal(WaitStarted(1.0))
    assert in_a_loop_of_its_own(heard(journal, 3, 5)) == [4, 5]


def test_the_oldest_events_are_forgotten() -> None:
    journal = Journal(kept=3)
    for seconds in range(5):
        journal(WaitStarted(float(seconds)))
    assert [entry.data["seconds"] for entry in journal.after(0)] == [2.0, 3.0, 4.0]
    assert journal.latest == 5


def test_following_ends_when_the_journal_is_closed() -> None:
    journal = Journal()

    async def follow_and_close() -> list[int]:
        follower = asyncio.create_task(heard(journal, 0, -1))
        await asyncio.sleep(0)
        journal(WaitStarted(1.0))
        threading.Thread(target=journal.close).start()
        return await asyncio.wait_for(follower, LONG)

    assert in_a_loop_of_its_own(follow_and_close()) == [1]


def test_an_event_is_stored_as_plain_values() -> None:
    journal = Journal()
    journal(BlowAccepted(Dof(3, Direction.Y), 2, 1, 10, 101.5))
    (entry,) = journal.after(0)
    assert entry.name == "BlowAccepted"
    assert entry.data == {"point": "3y", "blow": 2, "accepted": 1, "wanted": 10, "peak_force": 101.5}
