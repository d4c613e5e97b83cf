"""Entity tags: a known document is not sent again, and nobody overwrites a change that they have not seen."""

import hashlib
import inspect
from collections.abc import Callable, Coroutine
from functools import wraps
from typing import Annotated, Any

from fastapi import Header, Request, Response
from pydantic import TypeAdapter

from api.service.bodies import GuardedRoute
from api.service.problems import PreconditionError

IfMatch = Annotated[
    str | None, Header(alias="If-Match", description="the ETag that was read; refused where it has changed since")
]


def tag_of(body: bytes) -> str:
    """The entity tag of a document."""
    return f'"{hashlib.sha256(body).hexdigest()[:32]}"'


def check_unchanged(if_match: str | None, tag: str | None) -> None:
    """Check that a document is the one that the sender of a change has read; `tag` is None where there is none yet.

    Raises:
        PreconditionError: it has changed since.
    """
    if if_match is None:
        return
    tags = {each.strip() for each in if_match.split(",")}
    if tag is None or ("*" not in tags and tag not in tags):
        raise PreconditionError(f"If-Match is {if_match}, but it is {tag or 'not there'}; read it again")


class TaggedRoute(GuardedRoute):
    """A route whose JSON documents have an entity tag; a reader who sends it back gets 304 if nothing has changed.

    The thread that reads a document writes its text, too. So a large one keeps neither the event loop nor a request
    for a second thread waiting.
    """

    def __init__(self, path: str, endpoint: Callable[..., Any], **named: Any) -> None:
        methods = set(named.get("methods") or ())
        super().__init__(path, self._writing(endpoint) if methods == {"GET"} else endpoint, **named)
        self._adapter = None if self.response_model is None else TypeAdapter(self.response_model)

    def _writing(self, endpoint: Callable[..., Any]) -> Callable[..., Any]:
        """Wrap an endpoint so that it returns the serialised document; coroutine functions are returned unchanged."""
        if inspect.iscoroutinefunction(endpoint):
            return endpoint

        @wraps(endpoint)
        def written(*given: Any, **named: Any) -> Any:
            document = endpoint(*given, **named)
            if self._adapter is None or isinstance(document, Response):
                return document
            valid = self._adapter.validate_python(document, from_attributes=True)
            return Response(self._adapter.dump_json(valid, by_alias=True), media_type="application/json")

        return written

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The route's handler with tags."""
        handle = super().get_route_handler()

        async def tagged(request: Request) -> Response:
            response = await handle(request)
            if request.method != "GET" or response.status_code != 200 or response.media_type != "application/json":
                return response
            tag = tag_of(bytes(response.body))
            if tag in {each.strip().removeprefix("W/") for each in request.headers.get("if-none-match", "").split(",")}:
                return Response(status_code=304, headers={"ETag": tag})
            response.headers["ETag"] = tag
            return response

        return tagged
