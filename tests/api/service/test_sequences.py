"""Sequences over REST: those that are always there, and those that somebody keeps."""

from typing import Any

import httpx
import pytest

from jointlab.sequences import NAMES, built_in
from tests.api.conftest import paper
from tests.api.service.conftest import Acting


@pytest.mark.parametrize("name", NAMES)
def test_built_in_sequences_cannot_be_replaced(client: httpx.Client, acting: Acting, name: str) -> None:
    found = client.get(f"/api/sequences/{name}").json()["sequence"]
    assert found["title"] == built_in(name).title
    refused = client.put(f"/api/sequences/{name}", json=paper(), headers=acting())
    assert (refused.status_code, refused.json()["detail"]) == (409, f"{name} is built in; choose another name")


def test_a_sequence_is_stored_changed_unless_it_has_changed_since_and_deleted(
    client: httpx.Client, acting: Acting
) -> None:
    at, document = "/api/sequences/nightly", paper()
    assert client.put(at, json=document, headers=acting()).status_code == 200
    assert [each["name"] for each in client.get("/api/sequences").json()["items"]] == ["nightly"]
    tag = client.get(at).headers["ETag"]
    changed = document | {"title": "another"}
    assert client.put(at, json=changed, headers=acting() | {"If-Match": tag}).status_code == 200
    late: dict[str, Any] = acting() | {"If-Match": tag}
    assert client.put(at, json=document, headers=late).status_code == 412
    assert client.delete(at, headers=acting() | {"If-Match": tag}).status_code == 412
    assert client.get(at).json()["sequence"]["title"] == "another"
    assert client.delete(at, headers=acting()).status_code == 204
    assert client.get(at).status_code == 404
