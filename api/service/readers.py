"""Reads take turns, and leave the interpreter to the run between them.

A run and whoever reads share one interpreter. As many readers as like may ask; few are answered at a time, and while
the rig is at work each place then rests for as long as its answer took. So half of the interpreter is left for the run,
its heartbeat and STOP, however many ask and however little they rest. What acts does not queue behind reads.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from starlette.types import ASGIApp, Receive, Scope, Send

PLACES = 2  # reads that are answered at a time: one may wait for the database while another one is written out
LONGEST_REST = 0.02  # s; an answer that took longer waited rather than worked
ENDLESS = "/events"


class ReadersTakeTurns:
    """In front of the application: lets few reads in at a time; whatever acts, and streams of events, pass."""

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
        and not scope["path"].endswith(ENDLESS)
    )
