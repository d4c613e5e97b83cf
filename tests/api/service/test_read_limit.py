"""Reads are limited: few at a time, and nothing else waits for them."""

import asyncio
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor

import pytest
from starlette.types import Message, Receive, Scope, Send

from api.service.read_limit import PLACES, ReadLimit

MANY = 4 * PLACES


class Application:
    """Answers when told to, and counts the requests inside."""

    def __init__(self) -> None:
        self.inside = self.most = self.answered = 0
        self.may_answer = asyncio.Event()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self.inside += 1
        self.most = max(self.most, self.inside)
        await self.may_answer.wait()
        self.inside -= 1
        self.answered += 1


async def receive() -> Message:
    return {}


async def send(_message: Message) -> None:
    pass


def asked(front: ReadLimit, method: str, path: str, kind: str = "http") -> asyncio.Task[None]:
    async def ask() -> None:
        await front({"type": kind, "method": method, "path": path}, receive, send)

    return asyncio.create_task(ask())


async def settle() -> None:
    for _ in range(10):
        await asyncio.sleep(0)


def run(test: Callable[[], Awaitable[None]]) -> None:
    async def whole() -> None:
        await test()

    with ThreadPoolExecutor(1) as thread:  # a browser of another test may have left a loop running in this thread
        thread.submit(asyncio.run, whole()).result()


def test_few_reads_are_answered_at_a_time_and_all_in_the_end() -> None:
    async def test() -> None:
        app = Application()
        front = ReadLimit(app)
        reads = [asked(front, "GET", "/api/runs") for _ in range(MANY)]
        await settle()
        assert app.inside == PLACES
        app.may_answer.set()
        await asyncio.gather(*reads)
        assert (app.most, app.answered) == (PLACES, MANY)

    run(test)


@pytest.mark.parametrize(
    ("method", "path", "kind"),
    [
        ("POST", "/api/rig/stop", "http"),
        ("POST", "/api/runs/1/pause", "http"),
        ("GET", "/api/rig/events", "http"),
        ("GET", "/page/", "http"),
        ("GET", "/page/_nicegui_ws/socket.io", "websocket"),
    ],
)
def test_requests_that_act_and_streams_do_not_wait_for_reads(method: str, path: str, kind: str) -> None:
    async def test() -> None:
        app = Application()
        front = ReadLimit(app)
        reads = [asked(front, "GET", "/api/runs") for _ in range(MANY)]
        await settle()
        passing = asked(front, method, path, kind)
        await settle()
        assert app.inside == PLACES + 1
        app.may_answer.set()
        await asyncio.gather(passing, *reads)

    run(test)


def test_a_read_that_fails_gives_its_place_back() -> None:
    async def test() -> None:
        async def broken(scope: Scope, receive: Receive, send: Send) -> None:
            raise ValueError("broken")

        front = ReadLimit(broken)
        for _ in range(MANY):
            with pytest.raises(ValueError, match="broken"):
                await asked(front, "GET", "/api/runs")

    run(test)
