"""A layer in front of the application: few reads are answered at a time, with pauses during a run."""

import asyncio
from collections.abc import Awaitable, Callable

from starlette.types import ASGIApp, Receive, Scope, Send

PLACES = 2
"""The number of reads at a time: one may wait for the database while another one is written out."""
LONGEST_REST = 0.02
"""Seconds; an answer that took longer has mostly waited."""
STREAMS = ("/events", "/file")
"""Ends of the paths of what takes as long as its reader likes."""


class LimitedReads:
    """Answers few reads at a time; requests that act, streams of events and files do not wait.

    While the rig is at work, each place for a read then rests for as long as its answer took. So half of the time of
    the interpreter is left for what is not a read, such as a STOP that comes by REST, however many clients read. The
    rests were made when a run was in this process, too. It has a process of its own now; what STOP needs without them
    was not measured.
    """

    def __init__(
        self, app: ASGIApp, is_at_work: Callable[[], bool], rest: Callable[[float], Awaitable[None]] = asyncio.sleep
    ) -> None:
        self._app = app
        self._rest = rest
        self._is_at_work = is_at_work
        self._places = asyncio.Semaphore(PLACES)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request when it is its turn."""
        if not _is_read(scope):
            await self._app(scope, receive, send)
            return
        clock = asyncio.get_running_loop()
        async with self._places:
            began = clock.time()
            await self._app(scope, receive, send)
            if self._is_at_work():
                await self._rest(min(clock.time() - began, LONGEST_REST))


def _is_read(scope: Scope) -> bool:
    return (
        scope["type"] == "http"
        and scope["method"] == "GET"
        and scope["path"].startswith("/api/")
        and not scope["path"].endswith(STREAMS)
    )
