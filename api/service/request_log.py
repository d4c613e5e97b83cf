"""A number for every request: in its answer, and in every record of the log that it causes; and how long it took."""

import logging
import re
import time
from uuid import uuid4

from fastapi.routing import APIRoute
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from jointlab.logs import belonging_to
from jointlab.traces import FAILED, span

HEADER = "X-Request-ID"
SERVER_ERROR = 500
_GIVEN = re.compile(r"[A-Za-z0-9._-]{1,64}")
_RUN = re.compile(r"/api/runs/(\d{1,9})(?:/|$)")
log = logging.getLogger(__name__)


class RequestLog:
    """Takes the number that a client or proxy gives, or makes one, and logs each answer with its time.

    That is at the level debug, because clients decide how many answers there are.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        application = scope["app"]
        method, headers = scope["method"], Headers(scope=scope)
        given = headers.get(HEADER, "")
        number = given if _GIVEN.fullmatch(given) else uuid4().hex
        status, began = 0, time.monotonic()

        async def with_number(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)[HEADER] = number
            await send(message)

        ids: dict[str, str | int] = {"request": number}
        if run := _RUN.match(scope["path"]):
            ids["run"] = int(run[1])
        with belonging_to(**ids), span(method, headers, **ids) as opened:
            try:
                await self._app(scope, receive, with_number)
            finally:
                took = time.monotonic() - began
                opened.attributes |= {"http.request.method": method, "http.response.status_code": status}
                if status >= SERVER_ERROR:
                    opened.attributes[FAILED] = str(status)
                log.debug("%s %r answered %s in %.0f ms", method, scope["path"], status or "nothing", 1e3 * took)
                # the page is an application of its own; values in a path must not make a series each
                if scope["app"] is application and isinstance(route := scope.get("route"), APIRoute):
                    application.state.metrics.answered(method, route.path, took)
                    opened.name = f"{method} {route.path}"
                    opened.attributes["http.route"] = route.path
