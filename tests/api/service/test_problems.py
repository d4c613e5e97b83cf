"""Every error is a problem document, and says where it is wrong."""

import sqlite3
from contextlib import closing
from pathlib import Path

import httpx
import pytest

from store.catalogue import Catalogue
from store.measurements.runs import start_run
from store.states import Scope
from tests.api.conftest import paper
from tests.api.service.conftest import PROBLEM, MakeKey


@pytest.mark.parametrize(
    ("path", "status", "words"),
    [
        ("/api/runs/0", 422, "path.run_id"),
        ("/api/runs/99999999999999999999", 422, "path.run_id"),
        ("/api/runs/two", 422, "path.run_id"),
        ("/api/runs?limit=0", 422, "query.limit"),
        ("/api/runs?limit=5000", 422, "query.limit"),
        ("/api/runs?state=lost", 422, "query.state"),
        ("/api/runs?cursor=%21", 422, "no cursor"),
        ("/api/runs?cursor=bm8", 422, "no cursor"),
        ("/api/runs/99", 404, "no run 99"),
        ("/api/runs/99/history", 404, "no run 99"),
        ("/api/sequences/other", 404, "no sequence 'other'"),
        ("/api/rig", 409, "drives no rig"),
        ("/api/nothing", 404, "/api/nothing"),
    ],
)
def test_a_request_that_cannot_be_answered_gets_a_problem(
    client: httpx.Client, path: str, status: int, words: str
) -> None:
    answer = client.get(path)
    assert (answer.status_code, answer.headers["content-type"]) == (status, PROBLEM)
    problem = answer.json()
    assert (problem["type"], problem["status"]) == ("about:blank", status)
    assert words in problem["detail"]


def test_a_method_that_a_route_does_not_have_is_a_problem_too(client: httpx.Client) -> None:
    answer = client.delete("/api/health")
    assert (answer.status_code, answer.headers["content-type"], answer.headers["allow"]) == (405, PROBLEM, "GET")


def test_a_body_that_is_no_json_is_a_problem(client: httpx.Client, make_key: MakeKey) -> None:
    key = make_key(Scope.CONTROL)
    headers = {"content-type": "application/json", "Idempotency-Key": "a", "Authorization": f"Bearer {key}"}
    answer = client.put("/api/sequences/x", content=b"{", headers=headers)
    assert (answer.status_code, answer.headers["content-type"]) == (422, PROBLEM)


def test_a_sequence_with_a_character_that_no_database_keeps_is_refused(client: httpx.Client) -> None:
    document = paper() | {"title": "beam\0three"}
    answer = client.put("/api/sequences/x", json=document, headers={"Idempotency-Key": "a"})
    assert (answer.status_code, "NUL" in answer.json()["detail"]) == (422, True)


def test_a_database_that_does_not_answer_is_a_503(client: httpx.Client, catalogue: Catalogue, tmp_path: Path) -> None:
    with catalogue.writing() as session:
        start_run(session, kind="hammer", title="t", article="a", setup={})
    with closing(sqlite3.connect(tmp_path / "jointlab.db")) as connection:
        connection.execute("ALTER TABLE runs RENAME TO mislaid")
    for path in ("/api/runs", "/api/runs/1"):
        answer = client.get(path)
        assert (answer.status_code, answer.headers["content-type"]) == (503, PROBLEM)
        assert answer.json()["title"] == "The store does not answer"
