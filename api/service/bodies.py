"""Bodies of requests: bounded in size, parts and depth, and not read before it is known who sends them."""

import json
import re
from collections.abc import Callable, Coroutine
from http import HTTPStatus
from typing import Any

import numpy as np
from fastapi import HTTPException, Request, Response
from fastapi.dependencies.utils import get_flat_params
from fastapi.params import ParamTypes
from fastapi.routing import APIRoute
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.service.access import caller_of
from api.service.problems import problem
from store.text import contains_half

LARGEST = 256 * 1024
"""Bytes of a body at most. The largest document that is asked for is a sequence, of a few thousand bytes. One of this
size occupies the event loop for some milliseconds."""
DEEPEST = 32
"""Levels of lists and objects in each other at most; a sequence has seven."""
MOST = 5_000
"""Lists and objects at most: many of them make the interpreter look for garbage at length. A sequence has ten."""
TOO_LARGE = f"the body has more than {LARGEST} bytes; no document of this service needs that many"
STOP = re.compile("/api/rig/stop|/api/rigs/[^/]+/stop")
"""The paths whose request is obeyed whatever its body is, because that is never read."""
_STRING = re.compile(rb'"(?:[^"\\]|\\.)*"', re.DOTALL)
_NOT_BRACKETS = bytes(set(range(256)) - set(b"[]{}"))


class BodyLimit:
    """Refuses bodies of more than `LARGEST` bytes: at once where the length is declared, else when it is exceeded.

    A connection whose request was answered before a body of unknown length has come is closed: nobody reads the rest.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        declared = int(headers.get("content-length", "0"))  # digits: the server refuses other values
        if declared > LARGEST and not STOP.fullmatch(scope["path"]):
            refused = problem(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, TOO_LARGE, {"Connection": "close"})
            await refused(scope, receive, send)
            return
        is_whole = "transfer-encoding" not in headers and declared <= LARGEST
        came, answering = 0, False

        async def counted() -> Message:
            nonlocal came, is_whole
            message = await receive()
            came += len(message.get("body", b""))
            if came > LARGEST and not answering:
                raise HTTPException(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, TOO_LARGE)
            is_whole = is_whole or not message.get("more_body", False)
            return message

        async def last_of_its_connection(message: Message) -> None:
            nonlocal answering
            answering = True
            if message["type"] == "http.response.start" and not is_whole:
                MutableHeaders(scope=message)["Connection"] = "close"
            await send(message)

        await self._app(scope, counted, last_of_its_connection)


class BoundedRequest(Request):
    """A request whose JSON document is neither deeper than `DEEPEST` nor of more parts than `MOST`, and whose text is
    Unicode.
    """

    async def json(self) -> Any:
        """The document.

        Raises:
            HTTPException: it is too deep or too large, or has half of a surrogate pair.
            JSONDecodeError: it is none.
        """
        body = await self.body()
        number, depth = parts_of(body)
        if number > MOST or depth > DEEPEST:
            said = (
                f"the body has {number} lists and objects, at most {depth} in each other; {MOST} and {DEEPEST} may be"
            )
            raise HTTPException(422, said)
        document = json.loads(body)
        if contains_half(document):
            raise HTTPException(422, "text contains half of a surrogate pair")
        return document


def parts_of(document: bytes) -> tuple[int, int]:
    """The number of lists and objects of a JSON document, and how many are in each other where it is deepest."""
    brackets = np.frombuffer(_STRING.sub(b"", document).translate(None, _NOT_BRACKETS), np.uint8)
    begins = (brackets == ord("[")) | (brackets == ord("{"))
    return int(begins.sum()), int(np.cumsum(np.where(begins, 1, -1)).max(initial=0))


class GuardedRoute(APIRoute):
    """A route that knows its caller before it reads a body, reads no document that is too deep, and ignores nothing.

    A query parameter that it does not have is refused: a misspelt filter would give everything.
    """

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The route's handler behind the guard."""
        handle = super().get_route_handler()
        parameters = get_flat_params(self.dependant)
        known = sorted(each.alias for each in parameters if getattr(each.field_info, "in_", None) is ParamTypes.query)

        async def guarded(request: Request) -> Response:
            if unknown := sorted(set(request.query_params) - set(known)):
                there_are = f"there are {', '.join(known)}" if known else "there are none"
                raise HTTPException(422, f"no query parameter {', '.join(unknown)}; {there_are}")
            if self.body_field is not None:
                await caller_of(request)
            return await handle(BoundedRequest(request.scope, request.receive))

        return guarded
