"""Connections that do not go on: each ends in time, and however many there are, another client is answered."""

import itertools
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack

import httpx
import pytest

from api.service import connections
from api.service.connections import LARGEST_HEAD, PLACES, PLACES_OF_A_CLIENT
from store.catalogue import Catalogue
from tests.api.service.wire import PATIENCE, answer, connected, head, pour

SOON = 0.3  # s
BEGUN = b"GET /api/health HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: "
FORM = head("POST", "/page/log-in", "Content-Type: application/x-www-form-urlencoded", "Content-Length: 100")


@pytest.fixture
def hurried(monkeypatch: pytest.MonkeyPatch, client: httpx.Client) -> httpx.Client:
    """A service whose clients have `SOON` for everything."""
    for name in ("HEAD_TIME", "BODY_TIME", "ANSWER_TIME"):
        monkeypatch.setattr(connections, name, SOON)
    return client


def is_closed(connection: socket.socket) -> bool:
    """Whether the service closes a connection, after whatever it answers."""
    try:
        while connection.recv(65536):
            pass
    except ConnectionResetError:
        pass
    except TimeoutError:
        return False
    return True


@pytest.mark.parametrize("begun", [b"", b"G", BEGUN, b"\r\n\r\n"])
def test_a_request_that_does_not_come_ends_its_connection(hurried: httpx.Client, begun: bytes) -> None:
    with connected(hurried) as connection:
        connection.sendall(begun)
        assert is_closed(connection)


def test_a_request_that_comes_letter_by_letter_ends_its_connection(hurried: httpx.Client) -> None:
    with connected(hurried) as connection:
        connection.sendall(BEGUN)

        def letters() -> Iterator[bytes]:
            for _ in range(200):
                time.sleep(SOON / 20)
                yield b"x"

        assert pour(connection, letters()) < 200


def test_a_second_request_that_does_not_come_ends_its_connection_too(hurried: httpx.Client) -> None:
    with connected(hurried) as connection:
        connection.sendall(head("GET", "/api/health"))
        assert answer(connection)[0] == 200
        connection.sendall(BEGUN)
        assert is_closed(connection)


def test_a_body_that_does_not_come_ends_its_connection(hurried: httpx.Client) -> None:
    with connected(hurried) as connection:
        connection.sendall(head("POST", "/api/keys", "Content-Length: 10", "Content-Type: application/json"))
        assert is_closed(connection)


def test_an_answer_that_nobody_takes_ends_its_connection(hurried: httpx.Client) -> None:
    whole = len(hurried.get("/static-offline-docs/swagger-ui-bundle.js").content)
    with socket.socket() as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.connect((hurried.base_url.host, hurried.base_url.port))
        connection.sendall(6 * head("GET", "/static-offline-docs/swagger-ui-bundle.js"))
        time.sleep(3 * SOON)
        came = 0
        try:
            while piece := connection.recv(65536):
                came += len(piece)
        except ConnectionResetError:
            pass
        assert came < 6 * whole


def test_a_head_without_end_ends_its_connection(client: httpx.Client) -> None:
    with connected(client) as connection:
        connection.sendall(BEGUN)
        most = 64 * LARGEST_HEAD
        assert pour(connection, itertools.repeat(1024 * b"x", most // 1024)) < most


@pytest.mark.parametrize("begun", [b"", BEGUN, FORM])
def test_however_many_connections_wait_another_client_is_answered(client: httpx.Client, begun: bytes) -> None:
    with ExitStack() as stack:
        waiting = [stack.enter_context(connected(client)) for _ in range(PLACES_OF_A_CLIENT)]
        for each in waiting:
            each.sendall(begun)
        for _ in range(20):
            stack.enter_context(connected(client)).sendall(begun)
        assert all(map(is_closed, waiting[:10]))
        for _ in range(20):
            stopped = httpx.post(f"{client.base_url}/api/rig/stop", timeout=PATIENCE)
            assert stopped.status_code == 409  # it drives no rig


def test_a_connection_that_is_answered_keeps_its_place(client: httpx.Client, catalogue: Catalogue) -> None:
    with ExitStack() as stack, connected(client) as kept:
        for _ in range(PLACES_OF_A_CLIENT // 2):
            stack.enter_context(connected(client))
        for _ in range(3):
            kept.sendall(head("GET", "/api/health"))
            assert answer(kept)[0] == 200
    assert PLACES_OF_A_CLIENT <= PLACES
