"""A layer in front of the application: few reads are answered at a time."""

import asyncio

from starlette.types import ASGIApp, Receive, Scope, Send

PLACES = 2
"""The number of reads at a time: one may wait for the database while another one is written out."""
STREAMS = ("/events", "/file")
"""Ends of the paths of event streams and files, whose duration depends on the reader; they do not wait for a place."""


class ReadLimit:
    """Answers few reads at a time; requests that act, streams of events and files do not wait.

    So a STOP that comes by REST waits for two reads at most, however many clients read.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self._places = asyncio.Semaphore(PLACES)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request when it is its turn."""
        if not _is_read(scope):
            await self._app(scope, receive, send)
            return
        async with self._places:
            await self._app(scope, receive, send)


def _is_read(scope: Scope) -> bool:
    return (
        scope["type"] == "http"
        and scope["method"] == "GET"
        and scope["path"].startswith("/api/")
        and not scope["path"].endswith(STREAMS)
    )
