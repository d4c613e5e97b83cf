"""Requests that move the machine take as long as its instruments; nobody is told meanwhile that they are lost."""

import json
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Event, Thread

import pytest

from jointlab.client import Client, Driver
from jointlab.client.connection import ProblemError

TIMEOUT = 0.5  # s, of other requests
LEASE = {"token": "a", "holder": "ann", "seconds": 600.0}
RUN = {
    "id": 7, "kind": "sequence", "state": "running", "title": "t", "article": "a", "started_at": "2026-11-28T12:00:00Z",
    "finished_at": None, "reason": None, "configuration_hash": "", "software_version": "0.2", "rig": "rig",
}  # fmt: skip
RIG: dict[str, object] = {
    "phase": "idle", "run_id": None, "activity": "", "reason": None, "interlocks": [], "tripped": False,
    "tester_silent": None, "rest_unknown": None, "is_driven": True, "stop": None, "title": "", "point": None,
    "blows": 0, "blows_wanted": 0, "sines": 0, "sines_wanted": 0, "ended_as": None, "pressure": None, "pause": None,
    "stop_epoch": 1, "prompt": None, "driven_by": None, "latest_event": 1,
}  # fmt: skip


class Slow(BaseHTTPRequestHandler):
    """A service that answers a request that drives after three times as long as others may take, and only once."""

    seen: set[str]
    is_closed: Event

    def do_POST(self) -> None:
        self.rfile.read(int(self.headers.get("Content-Length", 0)))
        key = self.headers["Idempotency-Key"]
        if self.path == "/api/rig/lease":
            self._answer(201, LEASE)
        elif key in self.seen:
            self._answer(409, {"title": "Not in the present state", "detail": "it is under way, or was cut off"})
        else:
            self.seen.add(key)
            self.is_closed.wait(3 * TIMEOUT)
            self._answer(200, {"interlocks": ["force"]} if "acknowledge" in self.path else RUN)

    def do_GET(self) -> None:
        self._answer(200, RIG)

    def do_DELETE(self) -> None:
        self._answer(204, None)

    def _answer(self, status: int, document: object) -> None:
        body = b"" if document is None else json.dumps(document).encode()
        self.send_response(status)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Say nothing."""


@pytest.fixture
def address() -> Iterator[str]:
    handler = type("Handler", (Slow,), {"seen": set(), "is_closed": Event()})
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        server.handle_error = lambda *_: None  # type: ignore[method-assign]  # else it prints a traceback for each client that leaves early
        thread = Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


@pytest.mark.parametrize(
    "drive",
    [
        lambda rig: rig.start(7),
        lambda rig: rig.resume(7),
        lambda rig: rig.pause(7),
        lambda rig: rig.acknowledge_interlock(7, "removed"),
    ],
)
def test_a_request_that_drives_is_waited_for(address: str, drive: Callable[[Driver], object]) -> None:
    with Client(address, timeout=TIMEOUT) as lab, lab.driving("ann") as rig:
        assert drive(rig)


def test_other_requests_keep_the_time_limit(address: str) -> None:
    with Client(address, timeout=TIMEOUT) as lab, pytest.raises(ProblemError, match="under way"):
        lab.create_run("paper")
