"""The REST service: what was measured, page by page, and every error as a problem document."""

from __future__ import annotations

import json
import re
import socket
import sqlite3
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import httpx
import pytest
import uvicorn

from api.service import create_service
from store.catalogue import Catalogue
from store.runs import RunState, finish_run, start_run

Command = Callable[..., CompletedProcess[str]]
PROBLEM = "application/problem+json"


@pytest.fixture
def catalogue(measured: int, tmp_path: Path) -> Iterator[Catalogue]:
    """The demo's run, a failed one and one that goes on."""
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as opened:
        with opened.writing() as session:
            for title in ("failed", "goes on"):
                run = start_run(session, kind="sequence", title=title, article="beam 3", setup={})
                if title == "failed":
                    finish_run(session, run.id, RunState.FAILED, "nobody struck")
        yield opened


@pytest.fixture
def client(catalogue: Catalogue) -> Iterator[httpx.Client]:
    listener = socket.create_server(("127.0.0.1", 0))
    server = uvicorn.Server(uvicorn.Config(create_service(catalogue), log_level="warning"))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    with listener, httpx.Client(base_url=f"http://127.0.0.1:{listener.getsockname()[1]}", timeout=30) as client:
        yield client
        server.should_exit = True
        thread.join()


@pytest.fixture(scope="session")
def summary(demo: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((demo / "summary.json").read_text(encoding="utf-8"))
    return document


def test_health_says_that_the_database_answers(client: httpx.Client, tmp_path: Path) -> None:
    health = client.get("/api/health").json()
    assert health["status"] == "ok"
    assert health["database"] == f"sqlite:///{tmp_path / 'jointlab.db'}"
    assert re.fullmatch(r"\d+\.\d+.*", health["version"])


def test_a_database_that_does_not_answer_is_a_503(client: httpx.Client, tmp_path: Path) -> None:
    with closing(sqlite3.connect(tmp_path / "jointlab.db")) as connection:
        connection.execute("ALTER TABLE runs RENAME TO mislaid")
    for path in ("/api/health", "/api/runs", "/api/runs/1"):
        answer = client.get(path)
        assert (answer.status_code, answer.headers["content-type"]) == (503, PROBLEM)
        assert answer.json()["title"] == "The store does not answer"


def test_runs_come_newest_first_in_pages_and_by_state(client: httpx.Client) -> None:
    def numbers(**query: str | int) -> list[int]:
        return [run["id"] for run in client.get("/api/runs", params=query).json()]

    assert numbers() == [3, 2, 1]
    assert numbers(limit=2) == [3, 2]
    assert numbers(limit=2, offset=2) == [1]
    assert numbers(offset=7) == []
    assert numbers(state="failed") == [2]
    assert numbers(state="stopped") == []


def test_a_run_says_how_it_ended(client: httpx.Client) -> None:
    failed = client.get("/api/runs/2").json()
    assert (failed["state"], failed["reason"], failed["article"]) == ("failed", "nobody struck", "beam 3")
    assert client.get("/api/runs/3").json()["finished_at"] is None


def test_modes_joints_and_points_are_those_of_the_identification(client: httpx.Client, summary: dict[str, Any]) -> None:
    modes = client.get("/api/runs/1/modes").json()
    for name in ("frequency_hz", "loss_factor", "frequency_ci95", "loss_factor_ci95", "predicted_hz"):
        assert modes[name] == summary["modes"][name], name
    joints = client.get("/api/runs/1/joints").json()
    assert list(joints) == ["I", "II"]
    for joint, found in joints.items():
        for name in ("k", "h", "k_ci95", "h_ci95", "gamma", "observable"):
            assert found[name] == summary["inverse"][joint][name], (joint, name)
    points = client.get("/api/runs/1/dynamic-stiffness").json()
    assert len(points) == 36
    shear = client.get("/api/runs/1/dynamic-stiffness", params={"specimen": "II", "configuration": "shear"}).json()
    assert {(point["specimen"], point["configuration"]) for point in shear} == {("II", "shear")}
    small = [point["stiffness"] for point in shear if point["amplitude_pp_mm"] == 0.01]
    assert small == summary["direct"]["II"]["shear"]["0.01"]["k"]


@pytest.mark.parametrize("what", ["", "/modes", "/joints", "/dynamic-stiffness"])
@pytest.mark.parametrize("run", [99, 2])
def test_what_is_not_there_is_a_404_problem_that_names_the_run(client: httpx.Client, run: int, what: str) -> None:
    answer = client.get(f"/api/runs/{run}{what}")
    if run == 2 and not what:
        assert answer.status_code == 200
        return
    assert (answer.status_code, answer.headers["content-type"]) == (404, PROBLEM)
    problem = answer.json()
    assert (problem["type"], problem["title"], problem["status"]) == ("about:blank", "Not found", 404)
    assert f"run {run}" in problem["detail"]


@pytest.mark.parametrize(
    ("path", "status", "words"),
    [
        ("/api/runs/0", 422, "path.run_id"),
        ("/api/runs/99999999999999999999", 422, "path.run_id"),
        ("/api/runs/two", 422, "path.run_id"),
        ("/api/runs?limit=0", 422, "query.limit"),
        ("/api/runs?limit=5000", 422, "query.limit"),
        ("/api/runs?offset=-1", 422, "query.offset"),
        ("/api/runs?state=lost", 422, "query.state"),
        ("/api/nothing", 404, "/api/nothing"),
        ("/docs", 404, "/docs"),
    ],
)
def test_a_request_that_does_not_fit_is_a_problem_too(client: httpx.Client, path: str, status: int, words: str) -> None:
    answer = client.get(path)
    assert (answer.status_code, answer.headers["content-type"]) == (status, PROBLEM)
    assert answer.json()["status"] == status
    assert words in answer.json()["detail"]


def test_nothing_can_be_changed(client: httpx.Client) -> None:
    for path in client.get("/openapi.json").json()["paths"]:
        answer = client.request("DELETE", path.replace("{run_id}", "1"))
        assert (answer.status_code, answer.headers["content-type"]) == (405, PROBLEM)
        assert answer.headers["allow"] == "GET"


def test_every_error_is_documented_with_its_media_type(client: httpx.Client) -> None:
    document = client.get("/openapi.json").json()
    assert document["openapi"].startswith("3.")
    for path, operations in document["paths"].items():
        assert list(operations) == ["get"], path
        operation = operations["get"]
        assert operation.get("summary"), path
        assert operation.get("description"), path
        assert {"200", "404", "422", "503"} == set(operation["responses"]), path
        for status in ("404", "422", "503"):
            content = operation["responses"][status]["content"]
            assert list(content) == [PROBLEM], (path, status)
            assert set(content[PROBLEM]["schema"]["properties"]) == {"type", "title", "status", "detail"}
        assert list(operation["responses"]["200"]["content"]) == ["application/json"]
    assert "http" not in json.dumps(document).lower()


def test_serve_says_where_it_listens_and_answers_there(measured: int, tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "api.cli", "serve", "--port", "0"],
        env={"JOINTLAB_DATABASE_URL": f"sqlite:///{tmp_path / 'jointlab.db'}", "PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).resolve().parents[2],
    )
    with process:
        try:
            assert process.stdout is not None
            found = re.match(r"(http://127\.0\.0\.1:[1-9]\d*)/api/health, catalogue sqlite", process.stdout.readline())
            assert found
            runs = httpx.get(f"{found[1]}/api/runs", timeout=30).json()
            assert [run["id"] for run in runs] == [measured]
        finally:
            process.terminate()


def test_a_port_in_use_is_said_in_one_line(jointlab: Command) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        answer = jointlab("serve", "--port", port)
    assert answer.returncode == 3
    (line,) = answer.stderr.splitlines()
    assert line.startswith(f"jointlab: port {port} cannot be used: Address already in use")
