"""Connections of clients: few at a time, and an idle one is closed.

uvicorn limits the time between two requests only. Here a request has to arrive in time, an answer has to be taken in
time, and where the places are full, a connection without a request gives way to a new one. So slow or idle connections,
however many, keep nobody out.
"""

from asyncio import TimerHandle, Transport
from typing import Any

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

PLACES = 512
"""Connections at a time."""
PLACES_OF_A_CLIENT = 256
"""Connections at a time from one address; a browser has six and one for each tab."""
HEAD_TIME = 10.0
"""Seconds that the head of a request may take."""
BODY_TIME = 30.0
"""Seconds that its body may take."""
ANSWER_TIME = 60.0
"""Seconds that a client may take for the 64 KiB of an answer that wait to be sent."""
LARGEST_HEAD = 64 * 1024
"""Largest size of an incomplete request head, bytes; beyond it the connection is closed."""


class GuardedProtocol(HttpToolsProtocol):
    """uvicorn's protocol for one connection, with deadlines and a limited number of places."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._arriving: TimerHandle | None = None
        self._leaving: TimerHandle | None = None
        self._head = 0  # bytes of the present head so far
        self._since = self.loop.time()

    def connection_made(self, transport: Transport) -> None:  # type: ignore[override]  # as in uvicorn's own
        """Take a place, where need be of another connection."""
        super().connection_made(transport)
        self._arrive_within(HEAD_TIME)
        taken = [each for each in self.connections if each is not self]
        of_client = [each for each in taken if _address(each) == _address(self)]
        for here, places in ((of_client, PLACES_OF_A_CLIENT), (taken, PLACES)):
            if len(here) >= places:
                idle = [each for each in here if isinstance(each, GuardedProtocol) and each.is_idle]
                min(idle, key=GuardedProtocol.rank, default=self).transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """End the deadlines."""
        self._arrived()
        self.resume_writing()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Parse what has come."""
        if self.cycle is None or self.cycle.response_complete:
            self._head += len(data)
            if self._arriving is None:
                self._arrive_within(HEAD_TIME)
        super().data_received(data)
        if self._head > LARGEST_HEAD and not self.transport.is_closing():
            self.transport.abort()

    def on_headers_complete(self) -> None:
        """Go on to the body."""
        self._head = 0
        self._arrive_within(BODY_TIME)
        super().on_headers_complete()

    def on_message_complete(self) -> None:
        """The request has arrived."""
        self._arrived()
        super().on_message_complete()

    def on_response_complete(self) -> None:
        """Wait for the next request."""
        self._since = self.loop.time()
        super().on_response_complete()

    def handle_websocket_upgrade(self) -> None:
        """Leave the connection to the protocol of sockets, which asks for signs of life."""
        self._arrived()
        super().handle_websocket_upgrade()

    def pause_writing(self) -> None:
        """The client does not take its answer."""
        super().pause_writing()
        self._leaving = self.loop.call_later(ANSWER_TIME, self.transport.abort)

    def resume_writing(self) -> None:
        """The client has taken most of its answer."""
        if self._leaving is not None:
            self._leaving.cancel()
            self._leaving = None
        super().resume_writing()

    @property
    def is_idle(self) -> bool:
        """Whether the service waits for the client: for a request, the rest of one, or that it takes an answer."""
        waiting = self.cycle is None or self.cycle.response_complete or self._arriving is not None
        return (waiting or self._leaving is not None) and not self.transport.is_closing()

    def rank(self) -> tuple[bool, float]:
        """Rank among idle connections; the lowest gives its place: without an answer to send, and idle for longest."""
        return self._leaving is not None, self._since

    def _arrive_within(self, seconds: float) -> None:
        self._arrived()
        self._arriving = self.loop.call_later(seconds, self.transport.abort)

    def _arrived(self) -> None:
        if self._arriving is not None:
            self._arriving.cancel()
            self._arriving = None


def _address(connection: Any) -> str | None:
    return connection.client[0] if connection.client else None
