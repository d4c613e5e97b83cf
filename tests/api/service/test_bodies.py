"""Bodies of requests: refused by their size and depth, and by who sends them, before anybody reads them."""

import itertools
import json

import httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from api.service.bodies import DEEPEST, LARGEST, MOST, parts_of
from jointlab.documents.fields import OneLine
from store.states import Scope
from tests.api.service.conftest import PROBLEM, Acting, MakeKey
from tests.api.service.wire import answer, connected, head, pour

JSON = "Content-Type: application/json"
CHUNKED = "Transfer-Encoding: chunked"
CHUNK = b"8000\r\n" + 0x8000 * b"[" + b"\r\n"
MANY = 64 * LARGEST // len(CHUNK)


def test_a_body_that_is_declared_too_large_is_refused_before_it_comes(client: httpx.Client) -> None:
    with connected(client) as connection:
        connection.sendall(head("POST", "/api/runs", JSON, f"Content-Length: {LARGEST + 1}"))
        status, text = answer(connection)
        assert (status, PROBLEM in text) == (413, True)
        assert connection.recv(65536) == b""


def test_a_body_of_unknown_length_is_refused_when_it_is_too_large(client: httpx.Client, acting: Acting) -> None:
    headers = acting() | {"Content-Type": "application/json"}
    refused = client.post("/api/keys", content=itertools.repeat(b"[" * 1000, 2 * LARGEST // 1000), headers=headers)
    assert (refused.status_code, refused.headers["content-type"]) == (413, PROBLEM)
    assert refused.headers["connection"] == "close"


def test_a_caller_without_a_key_is_refused_before_its_body_comes(client: httpx.Client, make_key: MakeKey) -> None:
    make_key(Scope.READ)
    for length in ("Content-Length: 1000", CHUNKED):
        with connected(client) as connection:
            connection.sendall(head("POST", "/api/keys", JSON, length, "Idempotency-Key: test"))
            assert answer(connection)[0] == 401


def test_the_rest_of_a_refused_body_is_not_read(client: httpx.Client, make_key: MakeKey) -> None:
    make_key(Scope.READ)
    with connected(client) as connection:
        connection.sendall(head("POST", "/api/keys", JSON, CHUNKED, "Idempotency-Key: test"))
        assert answer(connection)[0] == 401
        assert pour(connection, itertools.repeat(CHUNK, MANY)) < MANY * len(CHUNK)


@pytest.mark.parametrize(("path", "status"), [("/api/rig/stop", 409), ("/api/rigs/B1/stop", 404)])
def test_a_stop_is_obeyed_however_large_its_body_is(client: httpx.Client, path: str, status: int) -> None:
    for length in (f"Content-Length: {1000 * LARGEST}", CHUNKED):
        with connected(client) as connection:
            connection.sendall(head("POST", path, JSON, length))
            assert answer(connection)[0] == status  # this service drives no rig, and knows none


def test_a_document_of_too_many_parts_or_too_deep_is_refused_in_words(client: httpx.Client, acting: Acting) -> None:
    headers = acting() | {"Content-Type": "application/json"}
    for body in ((DEEPEST + 1) * "[" + (DEEPEST + 1) * "]", f"[{MOST * '[],'}[]]"):
        refused = client.post("/api/keys", content=body, headers=headers)
        assert (refused.status_code, "in each other" in refused.json()["detail"]) == (422, True)
    flat = client.post("/api/keys", content=json.dumps({"name": "[" * 1000, "scopes": ["read:data"]}), headers=headers)
    assert flat.status_code == 422  # by the length of the name, not by its brackets
    assert "in each other" not in flat.json()["detail"]


def reference(document: object) -> tuple[int, int]:
    inner = document.values() if isinstance(document, dict) else document if isinstance(document, list) else None
    if inner is None:
        return 0, 0
    found = [reference(each) for each in inner]
    return 1 + sum(number for number, _ in found), 1 + max((depth for _, depth in found), default=0)


@given(
    st.recursive(
        st.text(alphabet='[]{}"\\a') | st.integers(),
        lambda inner: st.lists(inner) | st.dictionaries(st.text(alphabet='[]{}"\\a'), inner),
    )
)
def test_parts_are_lists_and_objects_whatever_the_texts_are(document: object) -> None:
    assert parts_of(json.dumps(document).encode()) == reference(document)


@pytest.mark.parametrize("document", [b"", b"]", b'"[[', b'"\\"[[[', b"\xff[", b"[]]][[[["])
def test_what_is_no_document_has_parts_too(document: bytes) -> None:
    number, depth = parts_of(document)
    assert 0 <= depth <= number <= len(document)


HALF = "text contains half of a surrogate pair"


@pytest.mark.parametrize(
    "body",
    [
        rb'{"name": "a\ud800", "scopes": ["read:data"]}',
        rb'{"name": "\udc00\ud800", "scopes": ["read:data"]}',
        rb'{"name": "a", "scopes": ["read:data"], "\ud800": 1}',
        b'{"name": "\xed\xa0\x80", "scopes": ["read:data"]}',
    ],
)
def test_a_text_with_half_of_a_surrogate_pair_is_refused_in_words(
    client: httpx.Client, acting: Acting, body: bytes
) -> None:
    headers = acting() | {"Content-Type": "application/json"}
    refused = client.post("/api/keys", content=body, headers=headers)
    assert (refused.status_code, refused.json()["detail"]) == (422, f"POST /api/keys: {HALF}")


def test_a_text_with_a_whole_surrogate_pair_is_taken(client: httpx.Client, acting: Acting) -> None:
    headers = acting() | {"Content-Type": "application/json"}
    made = client.post("/api/keys", content=rb'{"name": "\ud83d\ude00", "scopes": ["read:data"]}', headers=headers)
    assert (made.status_code, made.json()["name"]) == (201, "\N{GRINNING FACE}"), made.text


def test_no_path_and_no_query_carries_half_of_a_surrogate_pair(client: httpx.Client) -> None:
    assert client.get("/api/runs?article=%ED%A0%80").status_code == 200
    assert client.get("/api/sequences/%ED%A0%80").status_code == 422
    with pytest.raises(ValidationError, match=r"is 'a\\ud800', which contains half of a surrogate pair"):
        TypeAdapter[str](OneLine).validate_python("a\ud800")
