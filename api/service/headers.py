"""Headers of every answer: what a browser may do with it."""

import re

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

DOCUMENTATION = ("/docs", "/redoc")
PAGE = "/page"
EVERYWHERE = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
_NAME = re.compile(r"(\[[0-9a-fA-F:.]+\]|[A-Za-z0-9.-]+)(:\d+)?")


def policy_of(path: str, host: str) -> str:
    """The content security policy of an answer.

    The page may reach other ports of its own computer, because STOP has a listener of its own; NiceGUI needs scripts in
    its documents. Documents of /docs would fetch a logo from elsewhere.
    """
    framed = "frame-ancestors 'self'; base-uri 'none'; object-src 'none'"
    if path in DOCUMENTATION:
        return f"default-src 'self' 'unsafe-inline' data: blob:; {framed}"
    if not path.startswith(PAGE):
        return f"default-src 'none'; {framed}"
    name = found[1] if (found := _NAME.fullmatch(host)) else ""
    here = " ".join(["'self'", *(f"{scheme}://{name}:*" for scheme in ("http", "https", "ws", "wss") if name)])
    return (
        "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        f"img-src 'self' data: blob:; font-src 'self' data:; connect-src {here}; frame-src {here}; form-action {here}; "
        f"{framed}"
    )


class SecurityHeaders:
    """Adds the headers, without replacing any."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        policy = policy_of(scope["path"], Headers(scope=scope).get("host", ""))

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in (EVERYWHERE | {"Content-Security-Policy": policy}).items():
                    headers.setdefault(name, value)
            await send(message)

        await self._app(scope, receive, with_headers)
