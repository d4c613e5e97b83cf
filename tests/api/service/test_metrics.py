"""Metrics: what Prometheus reads of rig, jobs and database, also without the database."""

import json
import re
import sqlite3
import time
from contextlib import closing
from pathlib import Path

import httpx
from prometheus_client.parser import text_string_to_metric_families

from api.service.application import create_app
from api.service.context import Services
from jointlab.jobs.executors import ProcessExecutor
from jointlab.jobs.queue import JobQueue
from jointlab.supervision.manager import RunManager
from store.catalogue import Catalogue
from store.service.jobs import add_job, take_job
from tests.api.service.conftest import served
from tests.waiting import until

BOARD = Path(__file__).parents[3] / "deploy" / "grafana" / "jointlab.json"
OF_NO_PANEL = ("jointlab_info", "jointlab_stop_seconds", "jointlab_request_seconds", "jointlab_process")
"""Beginnings of names that need no panel of their own: versions, parts of histograms, and what a process has."""
Values = dict[tuple[str, ...], float]


def metrics(client: httpx.Client) -> Values:
    answer = client.get("/api/metrics")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "text/plain; version=0.0.4; charset=utf-8")
    families = text_string_to_metric_families(answer.text)
    return {(each.name, *each.labels.values()): each.value for family in families for each in family.samples}


def test_jobs_and_database_are_told(catalogue: Catalogue, tmp_path: Path) -> None:
    with catalogue.writing() as session:
        for _ in range(3):
            add_job(session, "export", {"run": 1, "form": "hdf5"}, "test")
        take_job(session, ["export"])
    with served(create_app(Services(catalogue, jobs=JobQueue(catalogue, ProcessExecutor(0))))) as client:
        until(lambda: metrics(client)["jointlab_database_answers",] == 1)
        found = metrics(client)
        assert (found["jointlab_jobs", "queued"], found["jointlab_jobs", "running"]) == (2, 1)
        assert found["jointlab_jobs_begin",] == 1
        assert found["jointlab_jobs_oldest_queued_seconds",] >= 0
        assert found["jointlab_process_resident_memory_bytes",] > 1e6
        assert not [name for name, *_ in found if name.startswith("jointlab_rig")]
        with closing(sqlite3.connect(tmp_path / "jointlab.db")) as connection:
            connection.execute("ALTER TABLE alembic_version RENAME TO mislaid")
        until(lambda: metrics(client)["jointlab_database_answers",] == 0)
        assert ("jointlab_jobs", "queued") not in metrics(client)


def test_the_rig_and_its_stops_are_told(rig_client: httpx.Client) -> None:
    found = metrics(rig_client)
    assert (found["jointlab_rig_phase", "idle"], found["jointlab_rig_phase", "running"]) == (1, 0)
    assert (found["jointlab_rig_interlock", "force"], found["jointlab_rig_lease_held",]) == (0, 0)
    assert found["jointlab_stop_seconds_count",] == 0
    started = time.monotonic()
    assert rig_client.post("/api/rig/stop").status_code == 200
    took = time.monotonic() - started
    found = metrics(rig_client)
    assert found["jointlab_stop_seconds_count",] == 1
    assert 0 < found["jointlab_stop_seconds_sum",] < took


def test_answers_are_counted_by_route_and_what_has_no_route_is_not(rig_client: httpx.Client) -> None:
    assert rig_client.get("/api/runs/1").status_code == 404
    assert rig_client.get("/api/runs/2").status_code == 404
    assert rig_client.get("/api/no-such-thing").status_code == 404
    counted = {
        key[1:]: value for key, value in metrics(rig_client).items() if key[0] == "jointlab_request_seconds_count"
    }
    assert counted["GET", "/runs/{run_id}"] == 2
    assert not [route for _, route in counted if "no-such-thing" in route]


def test_the_board_asks_for_metrics_that_exist_and_for_each_of_ours(catalogue: Catalogue, rig: RunManager) -> None:
    services = Services(catalogue, rig, jobs=JobQueue(catalogue, ProcessExecutor(0)))
    with served(create_app(services)) as client:
        assert client.get("/api/runs").status_code == 200
        until(lambda: metrics(client)["jointlab_database_answers",] == 1)
        there = {name for name, *_ in metrics(client)}
    panels = json.loads(BOARD.read_text(encoding="utf-8"))["panels"]
    asked = set(re.findall(r"jointlab_\w+", " ".join(target["expr"] for each in panels for target in each["targets"])))
    assert asked - there == set()
    assert {name for name in there - asked if not name.startswith(OF_NO_PANEL)} == set()
    assert len({each["id"] for each in panels}) == len(panels)
