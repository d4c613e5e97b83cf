"""The computer's clock is set back in the middle of a run: nothing is lost, and nobody gets what had ended."""

from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from typing import Any, Self

import httpx
import pytest

from api.service.application import create_app
from api.service.context import Services
from jointlab.jobs.executors import ProcessExecutor
from jointlab.jobs.queue import JobQueue
from jointlab.supervision.manager import RunManager
from store.backup.check import check
from store.catalogue import Catalogue
from store.service.keys import add_key
from store.states import Scope
from tests.api.conftest import paper
from tests.api.service.conftest import Acting, served
from tests.waiting import until

HOUR = timedelta(hours=1)
TELL_THE_TIME = (
    "jointlab.drive.journal", "api.service.monotonic_clock", "daq.task",
    "rig.runs.recorder", "rig.runs.run", "store.service.jobs", "store.service.keys", "store.models.base",
    "store.measurements.runs",
)  # fmt: skip
SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [0.1],
    "frequencies": {"first": 20, "last": 110, "step": 10},
}  # fmt: skip


class AnHourAgo(datetime):
    """What a module sees whose computer's clock was set back by an hour."""

    @classmethod
    def now(cls, tz: Any = None) -> Self:
        return super().now(tz) - HOUR


@pytest.fixture
def set_back(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Set the clock of this process back by an hour."""

    def act() -> None:
        for module in TELL_THE_TIME:
            monkeypatch.setattr(f"{module}.datetime", AnHourAgo)

    return act


@pytest.fixture
def lab(catalogue: Catalogue, rig: RunManager) -> Iterator[httpx.Client]:
    """A service that drives a simulated rig and does jobs."""
    with served(create_app(Services(catalogue, rig, jobs=JobQueue(catalogue, ProcessExecutor())))) as client:
        yield client


def test_a_run_its_lease_its_requests_and_its_jobs_go_on_and_keys_stay_ended(
    lab: httpx.Client, catalogue: Catalogue, acting: Acting, set_back: Callable[[], None]
) -> None:
    with catalogue.writing() as session:
        _, secret = add_key(session, "all", list(Scope))
        _, short = add_key(session, "short", [Scope.READ], datetime.now(UTC) + timedelta(seconds=1))
    asked = acting(secret)
    token = lab.post("/api/rig/lease", json={"holder": "test"}, headers=acting(secret)).json()["token"]
    bearer, ended = ({"Authorization": f"Bearer {each}"} for each in (secret, short))
    until(lambda: lab.get("/api/runs", headers=ended).status_code == 401)
    run = lab.post("/api/runs", json={"sequence": paper() | {"steps": [SWEEP]}}, headers=asked).json()
    path = f"/api/runs/{run['id']}"
    started = lab.post(f"{path}/start", json={"automatic": True}, headers=acting(secret, lease=token))
    assert started.status_code == 200, started.text
    until(lambda: lab.get("/api/rig", headers=bearer).json()["sines"] >= 3)

    set_back()
    assert lab.get("/api/runs", headers=ended).status_code == 401
    assert lab.get("/api/runs", headers=bearer).status_code == 200
    assert lab.put("/api/rig/lease", headers=bearer | {"Control-Lease": token}).status_code == 200
    again = lab.post("/api/runs", json={"sequence": paper() | {"steps": [SWEEP]}}, headers=asked)
    assert (again.json(), again.headers["idempotency-replayed"]) == (run, "true")
    until(lambda: lab.get("/api/rig", headers=bearer).json()["phase"] == "idle")
    done = lab.get(path, headers=bearer).json()
    assert done["state"] == "finished"
    assert done["reason"].startswith("the computer's clock was set back during the run, by at least 0:59")
    records = lab.get(f"{path}/sine-records", headers=bearer).json()["items"]
    assert [record["order_number"] for record in records] == list(range(1, 11))
    assert all(later["elapsed"] > earlier["elapsed"] for earlier, later in pairwise(records))

    export = {"run": run["id"], "form": "hdf5"}
    job = lab.post("/api/exports", json=export, headers=acting(secret)).json()["id"]
    until(lambda: lab.get(f"/api/jobs/{job}", headers=bearer).json()["state"] not in ("queued", "running"))
    found = lab.get(f"/api/jobs/{job}", headers=bearer).json()
    assert (found["state"], found["attempts"]) == ("done", 1)
    assert [finding for finding in check(catalogue) if finding.damage] == []
