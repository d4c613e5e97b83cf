"""The connection to the service: repeated requests, pages, events, and problems as exceptions."""

import json
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from typing import Any, TypeVar
from uuid import uuid4

import httpx
from pydantic import BaseModel

ModelT = TypeVar("ModelT", bound=BaseModel)
Query = Mapping[str, str | int | float | bool | Sequence[int] | None]
ATTEMPTS = 4
PAUSE = 0.2
"""Seconds before the second attempt; each further one waits twice as long."""
POLL_INTERVAL = 0.5
"""Seconds between two requests for the state of a run or a job."""


class ProblemError(Exception):
    """The service cannot do what was asked for; the message says why.

    Attributes:
        status: of HTTP; 0 where no service answers.
        title: what kind of problem it is.
    """

    def __init__(self, status: int, title: str, detail: str) -> None:
        super().__init__(detail)
        self.status = status
        self.title = title


@dataclass(frozen=True)
class RigEvent:
    """An event of the rig.

    Attributes:
        id: to continue after it when the connection was lost.
        name: such as BlowAccepted.
        at: UTC.
        data: of the event.
    """

    id: str
    name: str
    at: datetime
    data: dict[str, Any]


class Connection:
    """A connection to one service. Every request that acts has an idempotency key, so that it is safe to repeat it."""

    def __init__(self, address: str, key: str | None, timeout: float) -> None:
        headers = {} if key is None else {"Authorization": f"Bearer {key}"}
        self._timeout = timeout
        self._http = httpx.Client(base_url=f"{address.rstrip('/')}/api", headers=headers, timeout=timeout)

    def close(self) -> None:
        """Close it."""
        self._http.close()

    def request(
        self,
        method: str,
        path: str,
        *,
        query: Query | None = None,
        body: Any = None,
        headers: Mapping[str, str] | None = None,
        patience: float = 0.0,
    ) -> httpx.Response:
        """Send a request, and send it again where the connection was lost before the answer.

        Args:
            patience: s that its answer may take, where that is longer than for other requests.

        Raises:
            ProblemError: the service says why not, or does not answer.
        """
        sent = ({} if method == "GET" else {"Idempotency-Key": uuid4().hex}) | dict(headers or {})
        given = {name: value for name, value in (query or {}).items() if value is not None}
        limits = httpx.Timeout(self._timeout, read=max(self._timeout, patience))
        for attempt in range(1, ATTEMPTS + 1):
            try:
                answer = self._http.request(method, path, params=given, json=body, headers=sent, timeout=limits)
            except httpx.TransportError as error:
                if attempt == ATTEMPTS:
                    raise _unreachable(self._http, error) from error
                time.sleep(PAUSE * 2 ** (attempt - 1))
            else:
                return _checked(answer)
        raise AssertionError("the last attempt returns or raises")

    def get(self, model: type[ModelT], path: str, **query: str | int | float | bool | Sequence[int] | None) -> ModelT:
        """A document."""
        return model.model_validate_json(self.request("GET", path, query=query).content)

    def post(
        self,
        model: type[ModelT],
        path: str,
        body: Any = None,
        headers: Mapping[str, str] | None = None,
        patience: float = 0.0,
    ) -> ModelT:
        """The answer to a request that acts; `patience` as in `request`."""
        found = self.request("POST", path, body=body, headers=headers, patience=patience)
        return model.model_validate_json(found.content)

    def put(self, model: type[ModelT], path: str, body: Any) -> ModelT:
        """Replace a document."""
        return model.model_validate_json(self.request("PUT", path, body=body).content)

    def pages(self, model: type[ModelT], path: str, **query: str | int | float | bool | None) -> Iterator[ModelT]:
        """Every item of a list, page after page."""
        cursor: str | None = None
        while True:
            page = self.request("GET", path, query={**query, "cursor": cursor}).json()
            yield from (model.model_validate(each) for each in page["items"])
            cursor = page["next"]
            if cursor is None:
                return

    @contextmanager
    def events(self, path: str, last_event_id: str | None) -> Iterator[Iterator[RigEvent]]:
        """Events as they happen, until the context is left.

        Raises:
            ProblemError: the service says why not, or does not answer.
        """
        headers = {} if last_event_id is None else {"Last-Event-ID": last_event_id}
        try:
            with self._http.stream("GET", path, headers=headers, timeout=httpx.Timeout(30.0)) as stream:
                if stream.is_error:
                    stream.read()
                yield _events(_checked(stream))
        except httpx.TransportError as error:
            raise _unreachable(self._http, error) from error


def _events(stream: httpx.Response) -> Iterator[RigEvent]:
    """Events of a stream by the HTML standard; comments only keep the connection open."""
    fields: dict[str, str] = {}
    for line in stream.iter_lines():
        if line and not line.startswith(":"):
            name, _, value = line.partition(":")
            fields[name] = value.removeprefix(" ")
        elif not line and "data" in fields:
            data = json.loads(fields["data"])
            at = datetime.fromisoformat(data.pop("at"))
            yield RigEvent(fields.get("id", ""), fields.get("event", "message"), at, data)
            fields = {}


def _checked(answer: httpx.Response) -> httpx.Response:
    if not answer.is_error:
        return answer
    try:
        problem = answer.json()
        raise ProblemError(answer.status_code, problem["title"], problem["detail"])
    except (ValueError, KeyError, TypeError) as error:
        raise ProblemError(answer.status_code, answer.reason_phrase, answer.text) from error


def _unreachable(http: httpx.Client, error: httpx.TransportError) -> ProblemError:
    return ProblemError(0, "No service answers", f"no service answers at {http.base_url}: {error}")
