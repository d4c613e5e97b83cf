"""Sequences over REST: those that are always there, and those that somebody keeps."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import pytest

from api.service.application import create_app
from api.service.context import Services
from jointlab.sequences import NAMES, built_in, save_sequence
from rig.sequences.sequence import sequence_from
from store.catalogue import Catalogue
from tests.api.conftest import paper
from tests.api.service.conftest import Acting, served
from tests.databases import is_waiting
from tests.postgresql_server import Server
from tests.waiting import until


@pytest.mark.parametrize("name", NAMES)
def test_built_in_sequences_cannot_be_replaced_or_deleted(client: httpx.Client, acting: Acting, name: str) -> None:
    found = client.get(f"/api/sequences/{name}").json()["sequence"]
    assert found["title"] == built_in(name).title
    refused = client.put(f"/api/sequences/{name}", json=paper(), headers=acting())
    assert (refused.status_code, refused.json()["detail"]) == (409, f"{name} is built in; choose another name")
    refused = client.delete(f"/api/sequences/{name}", headers=acting())
    assert (refused.status_code, refused.json()["detail"]) == (409, f"{name} is built in and cannot be deleted")


def test_a_list_of_sequences_in_pages_has_each_once(client: httpx.Client, acting: Acting) -> None:
    for name in ("nightly", "tonight"):
        assert client.put(f"/api/sequences/{name}", json=paper(), headers=acting()).status_code == 200
    names: list[str] = []
    cursor: dict[str, str] = {}
    while True:
        page = client.get("/api/sequences", params={"limit": "1"} | cursor).json()
        names += [each["name"] for each in page["items"]]
        if page["next"] is None:
            break
        cursor = {"cursor": page["next"]}
    assert names == ["nightly", "paper", "suspended", "tonight"]


def test_a_sequence_is_stored_changed_unless_it_has_changed_since_and_deleted(
    client: httpx.Client, acting: Acting
) -> None:
    at, document = "/api/sequences/nightly", paper()
    assert client.put(at, json=document, headers=acting()).status_code == 200
    listed = client.get("/api/sequences").json()["items"]
    assert [(each["name"], each["built_in"]) for each in listed] == [
        ("nightly", False), ("paper", True), ("suspended", True)
    ]  # fmt: skip
    tag = client.get(at).headers["ETag"]
    changed = document | {"title": "another"}
    assert client.put(at, json=changed, headers=acting() | {"If-Match": tag}).status_code == 200
    late: dict[str, Any] = acting() | {"If-Match": tag}
    assert client.put(at, json=document, headers=late).status_code == 412
    assert client.delete(at, headers=acting() | {"If-Match": tag}).status_code == 412
    assert client.get(at).json()["sequence"]["title"] == "another"
    assert client.delete(at, headers=acting()).status_code == 204
    assert client.get(at).status_code == 404


@pytest.mark.parametrize("database_kind", ["postgresql"])  # SQLite has one writer at a time
@pytest.mark.parametrize("method", ["PUT", "DELETE"])
def test_a_sequence_that_another_one_changes_at_the_same_time_is_not_overwritten(
    database_url: str, tmp_path: Path, acting: Acting, postgresql: Server, method: str
) -> None:
    at, newer = "/api/sequences/nightly", sequence_from(paper() | {"title": "another"})
    with (
        Catalogue.open(database_url, tmp_path / "waveforms") as catalogue,
        served(create_app(Services(catalogue))) as client,
        ThreadPoolExecutor(1) as other,
    ):
        assert client.put(at, json=paper(), headers=acting()).status_code == 200
        given: dict[str, Any] = acting() | {"If-Match": client.get(at).headers["ETag"]}
        body = paper() | {"title": "mine"} if method == "PUT" else None
        with catalogue.writing() as session:
            save_sequence(session, "nightly", newer)
            session.flush()
            late = other.submit(client.request, method, at, headers=given, json=body)
            until(lambda: late.done() or is_waiting(postgresql))
        assert late.result().status_code == 412
        assert client.get(at).json()["sequence"]["title"] == "another"
