"""The health route says what does not work, and waits for nothing."""

import random
import sqlite3
from contextlib import ExitStack, closing
from pathlib import Path
from types import SimpleNamespace

import httpx
import pytest

from api.service.application import create_app
from api.service.context import Services
from jointlab.drive.process import SPOOLS, driving
from jointlab.jobs.executors import DaskExecutor
from jointlab.jobs.queue import JobQueue
from jointlab.settings import Settings, drive_folder
from jointlab.supervision.manager import RunManager
from simlab.laboratory import Laboratory
from store.catalogue import Catalogue
from tests.api.service.conftest import served
from tests.jointlab.runs.campaign import spooled
from tests.waiting import until


def impairments(client: httpx.Client) -> str:
    answer = client.get("/api/health")
    assert (answer.status_code, answer.json()["status"] == "ok") == (200, not answer.json()["impairments"])
    return " ".join(answer.json()["impairments"])


def test_a_whole_laboratory_is_in_order(rig_client: httpx.Client) -> None:
    assert impairments(rig_client) == ""


def test_a_database_that_does_not_answer_is_a_503_with_the_reason(client: httpx.Client, tmp_path: Path) -> None:
    assert impairments(client) == ""
    with closing(sqlite3.connect(tmp_path / "jointlab.db")) as connection:
        connection.execute("ALTER TABLE alembic_version RENAME TO mislaid")
    until(lambda: client.get("/api/health").status_code == 503)
    assert "alembic_version" in client.get("/api/health").json()["detail"]


def test_a_rig_that_does_not_answer_is_named(rig_client: httpx.Client, laboratory: Laboratory) -> None:
    laboratory.tester.faults.set("silent")
    until(lambda: "the rig does not answer: tcp://127.0.0.1" in impairments(rig_client))
    laboratory.tester.faults.clear()
    until(lambda: impairments(rig_client) == "")


def test_records_that_cannot_be_stored_are_named(
    impatient: None, rig_client: httpx.Client, catalogue: Catalogue, rig_settings: Settings, tmp_path: Path
) -> None:
    run = spooled(catalogue, tmp_path / "elsewhere", random.Random(1), 1)
    with closing(sqlite3.connect(tmp_path / "jointlab.db")) as other:
        other.execute("BEGIN IMMEDIATE")
        folder = drive_folder(rig_settings) / SPOOLS
        folder.mkdir()
        run.path.rename(folder / run.path.name)
        until(lambda: "records of the rig wait to be stored" in impairments(rig_client))
    until(lambda: impairments(rig_client) == "")


def test_a_cluster_that_does_not_answer_is_named(catalogue: Catalogue) -> None:
    pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    jobs = JobQueue(catalogue, DaskExecutor("tcp://127.0.0.1:9"))
    with served(create_app(Services(catalogue, jobs=jobs))) as client:
        until(lambda: "jobs wait: no dask scheduler answers at tcp://127.0.0.1:9" in impairments(client))


def test_readiness_names_a_drive_process_that_is_lost_and_liveness_does_not_depend_on_it(
    catalogue: Catalogue, rig_settings: Settings
) -> None:
    with ExitStack() as held:
        with driving(rig_settings):
            rig = held.enter_context(closing(RunManager(catalogue, rig_settings, starts=False)))
            client = held.enter_context(served(create_app(Services(catalogue, rig))))
            until(lambda: client.get("/api/health/ready").status_code == 200)
        until(lambda: client.get("/api/health/ready").status_code == 503)
        assert "drive process: " in client.get("/api/health/ready").json()["detail"]
        assert client.get("/api/health/live").json()["status"] == "alive"
        with driving(rig_settings):
            until(lambda: client.get("/api/health/ready").status_code == 200)


def test_readiness_names_everything_that_is_missing(
    catalogue: Catalogue, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    queue = JobQueue(catalogue, DaskExecutor("tcp://127.0.0.1:9"))
    full = SimpleNamespace(free=1_000_000)
    monkeypatch.setattr("jointlab.disk_probe.shutil.disk_usage", lambda _folder: full)
    with served(create_app(Services(catalogue, jobs=queue))) as client:
        with closing(sqlite3.connect(tmp_path / "jointlab.db")) as connection:
            connection.execute("ALTER TABLE alembic_version RENAME TO mislaid")

        def missing() -> str:
            answer = client.get("/api/health/ready")
            return str(answer.json()["detail"]) if answer.status_code == 503 else ""

        until(lambda: all(part in missing() for part in ("database: ", "executor of jobs: ", "disk space: ")))
        assert "1 MB are free, 200 MB are needed" in missing()
        assert client.get("/api/health/live").status_code == 200
