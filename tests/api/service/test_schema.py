"""The schema: as it was agreed on, complete, and kept to."""

import json
import re
from pathlib import Path
from typing import Any

import httpx
import pytest

from api.service.application import create_app
from api.service.context import Services
from store.catalogue import Catalogue
from tests.api.service.conftest import PROBLEM
from tests.api.service.fuzzing import fuzz

UNIT_BESIDE = {
    "AnswerDocument.readings", "NewAnswer.readings",  # those of the request
    "CalibrationDocument.sensitivity", "ChannelDocument.maximum", "ChannelDocument.minimum",
    "ChannelDocument.sensitivity", "CheckDocument.limit", "CheckDocument.measured", "ExaminedInstrument.sensitivity",
    "MissingDocument.measured", "MissingDocument.wanted",
    "NewCalibration.sensitivity", "ScatterDocument.deviation", "ScatterDocument.mean",
    "ScatterDocument.mean_ci95", "ScatterDocument.single_specimen_ci95", "ShiftParameter.ci95",
    "ShiftParameter.standard_error", "ShiftParameter.value", "Trace.values",
}  # fmt: skip
"""Quantities in the unit that a field beside them names."""
SNAPSHOT = Path(__file__).with_name("openapi.json")


@pytest.fixture
def document(catalogue: Catalogue) -> dict[str, Any]:
    return schema_of(catalogue)


def schema_of(catalogue: Catalogue) -> dict[str, Any]:
    """The schema without the version of the software, as plain JSON."""
    document: dict[str, Any] = json.loads(json.dumps(create_app(Services(catalogue)).openapi()))
    del document["info"]["version"]
    return document


def test_the_schema_is_the_one_that_clients_know(document: dict[str, Any]) -> None:
    """Where a change is meant: python -m tests.api.service.snapshot, and look at the difference."""
    assert document == json.loads(SNAPSHOT.read_text(encoding="utf-8"))


def test_every_error_is_documented_as_a_problem(document: dict[str, Any]) -> None:
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            where = f"{method} {path}"
            assert operation["summary"], where
            assert operation["description"], where
            for status, response in operation["responses"].items():
                if status.startswith(("4", "5")):
                    assert list(response["content"]) == [PROBLEM], where
            assert {"422", "503"} <= set(operation["responses"]), where
            if operation.get("security"):
                assert {"401", "403"} <= set(operation["responses"]), where
            if "{run_id}" in path:
                assert "404" in operation["responses"], where


def test_every_request_that_acts_has_an_idempotency_key(document: dict[str, Any]) -> None:
    without = {
        f"{method.upper()} {path}"
        for path, operations in document["paths"].items()
        for method, operation in operations.items()
        if method != "get" and not any(p["name"] == "Idempotency-Key" for p in operation.get("parameters", []))
    }
    # a stop and the renewal of a lease may be asked for again and again
    assert without == {"POST /api/rig/stop", "POST /api/rigs/{name}/stop", "PUT /api/rig/lease"}


def test_every_quantity_that_is_sent_or_answered_has_its_unit(document: dict[str, Any]) -> None:
    missing = [
        f"{name}.{field}"
        for name, model in document["components"]["schemas"].items()
        for field, about in model.get("properties", {}).items()
        if '"type": "number"' in json.dumps(about) and "x-unit" not in about
    ]
    assert sorted(missing) == sorted(UNIT_BESIDE)


@pytest.mark.parametrize("path", ["/docs", "/redoc"])
def test_documentation_needs_no_outside_network(client: httpx.Client, path: str) -> None:
    page = client.get(path)
    assert page.status_code == 200
    wanted = re.findall(r"""(?:src|href)=["']([^"']+)["']""", page.text)
    assert len(wanted) >= 2
    for address in wanted:
        assert address.startswith("/"), address
        assert client.get(address).status_code == 200, address
    assert not re.search(r"https?://", page.text)


def test_generated_requests_get_what_the_schema_says(tmp_path: Path) -> None:
    cases, failures = fuzz(tmp_path, "examples,fuzzing,stateful", 2, seed=1)
    assert not failures, failures
    assert cases > 200
