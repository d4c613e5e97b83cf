"""Downloads: slow ones hold up no other request, and their number is limited."""

import socket
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest

from api.service.downloads import DOWNLOADS, DOWNLOADS_OF_A_CALLER, DownloadPlaces, TooManyDownloadsError
from jointlab.jobs.kinds import exports_folder
from store.catalogue import Catalogue
from store.service.jobs import add_job, finish_job, take_job
from store.states import Scope
from tests.api.service.conftest import PROBLEM, MakeKey
from tests.api.service.wire import PATIENCE, answer, head

SIZE = 32_000_000  # more than fits into the buffers of a connection


@pytest.fixture
def catalogue(database_url: str, tmp_path: Path) -> Iterator[Catalogue]:
    with Catalogue.open(database_url, tmp_path / "waveforms") as opened:
        yield opened


@pytest.fixture
def export(catalogue: Catalogue) -> int:
    """A large file of an export; its number."""
    folder: Path = exports_folder(catalogue)
    folder.mkdir()
    (folder / "large.h5").write_bytes(bytes(SIZE))
    with catalogue.writing() as session:
        add_job(session, "export", {"run": 1, "form": "hdf5"}, "test")
        taken = take_job(session, ["export"])
        assert taken is not None
        finish_job(session, taken[0].id, taken[1], {"file": "large.h5", "bytes": SIZE})
    return taken[0].id


def begun(client: httpx.Client, path: str, secret: str) -> tuple[socket.socket, int]:
    """A download of which only the head is read, and its status."""
    connection = socket.socket()
    connection.settimeout(PATIENCE)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.connect((client.base_url.host, client.base_url.port))
    connection.sendall(head("GET", path, f"Authorization: Bearer {secret}"))
    return connection, answer(connection)[0]


def test_slow_downloads_hold_up_no_reader_and_their_number_is_limited(
    client: httpx.Client, make_key: MakeKey, export: int
) -> None:
    secret, other = make_key(Scope.READ), make_key(Scope.READ)
    path = f"/api/exports/{export}/file"
    with ExitStack() as stack:
        for _ in range(DOWNLOADS_OF_A_CALLER):
            connection, status = begun(client, path, secret)
            stack.callback(connection.close)
            assert status == 200
        for _ in range(5):
            assert client.get("/api/health").status_code == 200
            assert client.get("/api/runs", headers={"Authorization": f"Bearer {other}"}).status_code == 200
        refused = client.get(path, headers={"Authorization": f"Bearer {secret}"})
        assert (refused.status_code, refused.headers["content-type"]) == (429, PROBLEM)
        assert refused.headers["retry-after"]
        whole = client.get(path, headers={"Authorization": f"Bearer {other}"})
        assert (whole.status_code, len(whole.content)) == (200, SIZE)


def test_a_place_is_free_when_a_download_ends(client: httpx.Client, make_key: MakeKey, export: int) -> None:
    headers = {"Authorization": f"Bearer {make_key(Scope.READ)}"}
    for _ in range(2 * DOWNLOADS_OF_A_CALLER):
        assert len(client.get(f"/api/exports/{export}/file", headers=headers).content) == SIZE


def test_places_are_limited_in_total_too() -> None:
    places = DownloadPlaces()
    with ExitStack() as stack:
        for number in range(DOWNLOADS):
            stack.enter_context(places.place(f"caller {number}"))
        with pytest.raises(TooManyDownloadsError, match="sent to others"), places.place("another"):
            pass
    with places.place("another"):
        pass
