"""Pages that describe the interface, kept from loading anything from outside."""

from __future__ import annotations

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

PAGES = frozenset({"/docs", "/redoc"})
ONLY_FROM_HERE = "default-src 'self' 'unsafe-inline' data: blob:"
"""Content security policy; what these pages' own libraries would fetch otherwise is a logo."""


class DocumentationFromHere:
    """Tells browsers that the documentation's pages load from this service alone."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http" or scope["path"] not in PAGES:
            await self._app(scope, receive, send)
            return

        async def with_policy(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message)["Content-Security-Policy"] = ONLY_FROM_HERE
            await send(message)

        await self._app(scope, receive, with_policy)
