"""Alarms over REST: a run that trips is told by webhook and stands until somebody acknowledges it."""

import json
from collections.abc import Iterator
from contextlib import closing
from typing import Any

import httpx
import pytest

from api.service.application import create_app
from api.service.context import Services
from jointlab.alarms import deliverer, watch
from jointlab.alarms.alarms import Alarms
from jointlab.alarms.webhook import Webhook
from jointlab.client import Client
from jointlab.settings import Settings
from jointlab.supervision.manager import RunManager
from rig.sequences.sequence import sequence_from
from simlab.laboratory import Laboratory
from simlab.tester_server import TesterFault
from store.catalogue import Catalogue
from store.states import RunState, Scope
from tests.api.conftest import paper
from tests.api.service.conftest import Acting, MakeKey, served
from tests.jointlab.alarms.receivers import Received, web_server
from tests.waiting import until

SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [0.1],
    "frequencies": {"first": 20, "last": 200, "step": 1},
}  # fmt: skip


@pytest.fixture
def receiver() -> Iterator[Received]:
    with web_server() as received:
        yield received


@pytest.fixture
def lab(
    catalogue: Catalogue, rig: RunManager, rig_settings: Settings, receiver: Received, monkeypatch: pytest.MonkeyPatch
) -> Iterator[httpx.Client]:
    """A service on a simulated rig that tells a receiver of alarms."""
    monkeypatch.setattr(deliverer, "POLL", 0.02)
    monkeypatch.setattr(watch, "POLL", 0.02)
    alarms = Alarms(catalogue, rig_settings, rig, [Webhook(receiver.url, "a secret", 5.0)])
    with served(create_app(Services(catalogue, rig, alarms=alarms))) as client:
        yield client


def begin(rig: RunManager) -> int:
    """Begin a sweep, and see it measure."""
    run = rig.plan(sequence_from(paper() | {"steps": [SWEEP]}), "test")
    rig.start(run, "test", automatic=True)
    until(lambda: rig.state.sines > 0 or rig.state.ended_as is not None)
    return run


def told(client: httpx.Client, **query: Any) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = client.get("/api/alarms", params=query).json()["items"]
    return found


def test_a_run_that_trips_is_told_and_stands_until_somebody_acknowledges_it(
    lab: httpx.Client, rig: RunManager, laboratory: Laboratory, receiver: Received, acting: Acting
) -> None:
    run = begin(rig)
    laboratory.tester.emergency_stop()
    until(lambda: bool(receiver.bodies))
    body = json.loads(receiver.bodies[0])
    assert (body["kind"], body["run"], body["rig"]) == ("run_ended", run, "rig")
    assert "has failed" in body["text"]
    assert "emergency stop" in body["text"].lower()
    until(lambda: told(lab)[0]["deliveries"][0]["delivered_at"] is not None)
    (alarm,) = told(lab, standing=True)
    assert (alarm["uid"], alarm["run_id"], alarm["text"]) == (body["id"], run, body["text"])
    assert [(each["channel"], each["result"]) for each in alarm["deliveries"]] == [("webhook", "200 OK")]
    path = f"/api/alarms/{alarm['id']}/acknowledge"
    done = lab.post(path, json={"note": "released it"}, headers=acting()).json()
    assert (done["acknowledged_by"], done["note"]) == ("at this computer", "released it")
    again = lab.post(path, json={"note": "me too"}, headers=acting()).json()
    assert again["note"] == "released it"
    assert told(lab, standing=True) == []
    assert told(lab, standing=False)[0]["id"] == alarm["id"]
    audit = lab.get("/api/audit", params={"action": "acknowledge alarm"}).json()["items"]
    assert [(entry["target"], entry["details"]["note"]) for entry in reversed(audit)] == [
        (f"alarm {alarm['id']}", "released it"), (f"alarm {alarm['id']}", "me too"),
    ]  # fmt: skip
    assert len(receiver.bodies) == 1


def test_a_tester_that_falls_silent_while_a_run_waits_is_told_before_the_run_needs_it(
    lab: httpx.Client, rig: RunManager, laboratory: Laboratory, receiver: Received, acting: Acting
) -> None:
    run = rig.plan(sequence_from(paper() | {"steps": [{"step": "wait", "seconds": 600}, SWEEP]}), "test")
    rig.start(run, "test", automatic=True)
    laboratory.tester.faults.set(TesterFault.SILENT)
    until(lambda: bool(receiver.bodies))
    body = json.loads(receiver.bodies[0])
    assert (body["kind"], f"while run {run} waits" in body["text"]) == ("tester_silent", True)
    assert rig.state.run_id == run
    laboratory.tester.faults.clear()
    until(lambda: rig.state.tester_silent is None)
    number = told(lab)[0]["id"]
    assert lab.post(f"/api/alarms/{number}/acknowledge", json={}, headers=acting()).status_code == 200
    rig.end_run(run)
    rig.wait()
    assert told(lab, standing=True) == []


def test_a_run_that_a_person_stops_is_no_alarm(
    lab: httpx.Client, rig: RunManager, receiver: Received, acting: Acting
) -> None:
    run = begin(rig)
    assert lab.post("/api/rig/stop").json() == {"run_id": run}
    rig.wait()
    assert rig.state.ended_as is RunState.STOPPED
    made = lab.post("/api/alarms/test", headers=acting()).json()
    until(lambda: bool(receiver.bodies))
    assert [alarm["id"] for alarm in told(lab)] == [made["id"]]
    assert json.loads(receiver.bodies[0])["id"] == made["uid"]


def test_what_needs_which_scope(lab: httpx.Client, acting: Acting, make_key: MakeKey) -> None:
    reader, control, admin = (make_key(scope) for scope in (Scope.READ, Scope.CONTROL, Scope.ADMIN))
    assert lab.post("/api/alarms/test", headers=acting(control)).status_code == 403
    made = lab.post("/api/alarms/test", headers=acting(admin))
    assert made.status_code == 201
    path = f"/api/alarms/{made.json()['id']}/acknowledge"
    assert lab.get("/api/alarms").status_code == 401
    assert lab.post(path, json={}, headers=acting(reader)).status_code == 403
    assert lab.post(path, json={}, headers=acting(control)).status_code == 200
    assert lab.post("/api/alarms/99/acknowledge", json={}, headers=acting(control)).status_code == 404
    with closing(Client(str(lab.base_url), reader)) as client:
        assert [alarm.id for alarm in client.alarms(standing=False)] == [made.json()["id"]]


def test_a_client_raises_a_test_and_acknowledges_it(lab: httpx.Client, make_key: MakeKey) -> None:
    with Client(str(lab.base_url), make_key(*Scope)) as client:
        alarm = client.test_alarms()
        assert client.acknowledge_alarm(alarm.id, "it works").note == "it works"


def test_a_service_that_tells_nobody_says_so(client: httpx.Client, acting: Acting) -> None:
    answer = client.post("/api/alarms/test", headers=acting())
    assert (answer.status_code, "tells no alarms" in answer.json()["detail"]) == (409, True)
