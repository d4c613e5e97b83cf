"""Requests at once share few: each caller gets the outcome of one that began after its call."""

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from jointlab.supervision.shared_request import SharedRequest
from rig.errors import RigError
from tests.waiting import LONG, until

CALLERS = 30


class Requests:
    """Requests that wait until they may end."""

    def __init__(self, trouble: str = "") -> None:
        self.begun = list[str]()
        self.may_end = threading.Event()
        self.trouble = trouble

    def do(self, who: str) -> int:
        self.begun.append(who)
        number = len(self.begun)
        assert self.may_end.wait(LONG)
        if self.trouble:
            raise RigError(self.trouble)
        return number


@pytest.mark.parametrize("trouble", ["", "no reply"])
def test_callers_that_wait_share_the_next_request_and_its_outcome(trouble: str) -> None:
    requests = Requests(trouble)
    shared = SharedRequest(requests.do, places=2)
    with ThreadPoolExecutor(CALLERS) as callers:
        first = [callers.submit(shared, str(number)) for number in range(2)]
        until(lambda: len(requests.begun) == 2)
        others = [callers.submit(shared, "another") for _ in range(CALLERS - 2)]
        until(lambda: shared._next is not None)
        requests.may_end.set()
        errors = [future.exception() for future in (*first, *others)]
    assert len(requests.begun) < CALLERS / 2
    if trouble:
        assert {str(error) for error in errors} == {trouble}
    else:
        assert errors == [None] * CALLERS
        assert all(future.result() > 2 for future in others)  # not one that had begun before


def test_a_call_after_the_last_outcome_makes_a_request_of_its_own() -> None:
    requests = Requests()
    requests.may_end.set()
    shared = SharedRequest(requests.do, places=1)
    assert [shared("one"), shared("two")] == [1, 2]
    assert requests.begun == ["one", "two"]
