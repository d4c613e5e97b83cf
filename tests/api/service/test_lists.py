"""Lists come in pages, every one of them, and results of older analyses can be read beside the newest."""

import json
from base64 import urlsafe_b64encode
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import httpx
import pytest

from store.catalogue import Catalogue
from store.measurements.frequency_responses import add_frequency_responses
from store.results.analyses import add_analysis
from store.results.modes import add_modes
from store.states import AnalysisKind, Scope
from tests.api.service.conftest import MakeKey
from tests.store.conftest import fill, frequency_response_set, mode_set

LISTS = {
    "/runs/1/channels": 2,
    "/runs/1/history": 2,
    "/runs/2/amendments": 1,
    "/runs/1/points": 2,
    "/runs/1/blows": 6,
    "/runs/1/analyses": 7,
    "/runs/1/frequency-responses": 2,
    "/runs/1/joint-matrices": 2,
    "/runs/1/comparisons": 3,
    "/runs/2/dynamic-stiffness": 4,
    "/instruments": 4,
    "/instruments/1/calibrations": 1,
    "/specimens": 2,
    "/alarms": 1,
}
"""How many items each of these lists has, in the catalogue that `filled` makes."""


@pytest.fixture
def filled(catalogue: Catalogue) -> Catalogue:
    """A catalogue with something of everything, whose modes and accelerances were computed twice."""
    fill(catalogue)
    with catalogue.writing() as session:
        again = add_analysis(session, kind=AnalysisKind.FREQUENCY_RESPONSES, method="Hv", settings={}, runs=[1])
        doubled = replace(frequency_response_set(), accelerance=2 * frequency_response_set().accelerance)
        for number in (1, 2):
            add_frequency_responses(session, again, 1, replace(doubled, number=number))
        modes = add_analysis(session, kind=AnalysisKind.MODES, method="LSCF", settings={"order": 30}, runs=[1])
        add_modes(session, modes, replace(mode_set(), frequency=mode_set().frequency + 1.0))
    return catalogue


@pytest.fixture
def lab(filled: Catalogue, client: httpx.Client, make_key: MakeKey) -> httpx.Client:
    """A service in front of it, to be read."""
    client.headers["Authorization"] = f"Bearer {make_key(Scope.READ)}"
    return client


def test_a_query_parameter_that_does_not_exist_is_refused_with_those_that_do(client: httpx.Client) -> None:
    answer = client.get("/api/runs", params={"artcle": "beam 3"})
    assert (answer.status_code, answer.json()["detail"]) == (
        422,
        "GET /api/runs: no query parameter artcle; "
        "there are article, cursor, kind, limit, since, specimen, state, text, until",
    )
    none = client.get("/api/runs/1", params={"full": 1})
    assert (none.status_code, "there are none" in none.json()["detail"]) == (422, True)


def pages(client: httpx.Client, path: str, limit: int) -> Iterator[list[Any]]:
    """The items of each page of a list."""
    cursor = None
    while True:
        query = {"limit": limit} | ({} if cursor is None else {"cursor": cursor})
        answer = client.get(f"/api{path}", params=query)
        assert answer.status_code == 200, answer.text
        yield answer.json()["items"]
        cursor = answer.json()["next"]
        if cursor is None:
            return


def test_a_list_comes_page_by_page_with_nothing_twice_and_nothing_left_out(lab: httpx.Client) -> None:
    for path, count in LISTS.items():
        (whole,) = pages(lab, path, 1000)
        assert len(whole) == count, path
        single = list(pages(lab, path, 1))
        assert [item for page in single for item in page] == whole, path
        assert {len(page) for page in single} == {1}, path


def test_a_page_of_sine_points_may_begin_behind_a_number_of_8_bytes(lab: httpx.Client) -> None:
    behind = {"cursor": urlsafe_b64encode(b"3000000000").decode().rstrip("="), "article": "beam 3"}
    assert len(lab.get("/api/dynamic-stiffness", params=behind).json()["items"]) > 0
    assert lab.get("/api/runs", params=behind).status_code == 422


def test_every_list_has_pages(client: httpx.Client) -> None:
    document = client.get("/openapi.json").json()
    whole = [
        path
        for path, operations in document["paths"].items()
        if '"type": "array"' in json.dumps(_answer(operations).get("schema", {}))
    ]
    assert whole == []


def _answer(operations: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = operations.get("get", {}).get("responses", {}).get("200", {}).get("content", {})
    return dict(found.get("application/json", {}))


def test_older_modes_are_read_by_the_number_of_their_analysis(lab: httpx.Client) -> None:
    newest, older = lab.get("/api/runs/1/analyses", params={"kind": "modes"}).json()["items"]
    assert (newest["settings"], older["settings"]) == ({"order": 30}, {"order": 20})
    for analysis, expected in ((newest, mode_set().frequency + 1.0), (older, mode_set().frequency)):
        found = lab.get("/api/runs/1/modes", params={"analysis": analysis["id"]}).json()
        assert (found["analysis_id"], found["frequency_hz"]) == (analysis["id"], expected.tolist())
    assert lab.get("/api/runs/1/modes").json()["analysis_id"] == newest["id"]


def test_older_accelerances_are_read_by_the_number_of_their_analysis(lab: httpx.Client) -> None:
    newest, older = lab.get("/api/runs/1/analyses", params={"kind": "frequency_responses"}).json()["items"]
    measured = frequency_response_set().accelerance[1].real
    for analysis, sets, factor in ((newest, [1, 2], 2.0), (older, [1], 1.0)):
        query = {"analysis": analysis["id"]}
        found = lab.get("/api/runs/1/frequency-responses", params=query).json()["items"]
        assert [each["number"] for each in found] == sets
        one = lab.get("/api/runs/1/frequency-responses/1/4y", params=query).json()
        assert one["real"] == (factor * measured).tolist()


def test_an_analysis_of_another_kind_has_no_such_results(lab: httpx.Client) -> None:
    (direct,) = lab.get("/api/runs/2/analyses", params={"kind": "dynamic_stiffness"}).json()["items"]
    results = ("modes", "joint-matrices", "comparisons", "frequency-responses", "frequency-responses/1/4y")
    for what in results:
        answer = lab.get(f"/api/runs/1/{what}", params={"analysis": direct["id"]})
        assert answer.status_code == 404, what
        assert f"analysis {direct['id']}" in answer.json()["detail"], what
