"""The audit log: what moves the machine is in it before it moves, and what was refused, too."""

import sqlite3
from contextlib import closing
from pathlib import Path

import httpx
import pytest

from jointlab.audit import HOUR, REFUSALS_AN_HOUR, AuditedAction, RefusalLog
from jointlab.supervision.manager import RunManager
from store.catalogue import Catalogue
from store.service.audit import AuditEntry, list_audit_entries
from store.states import Scope
from tests.api.conftest import paper
from tests.api.service.conftest import Acting, MakeKey
from tests.waiting import LONG

HAMMER = {"step": "hammer", "points": ["5y"], "blows": 2, "block_seconds": 1.0}


def entries(catalogue: Catalogue) -> list[AuditEntry]:
    """Everything noted, oldest first."""
    with catalogue.reading() as session:
        return list_audit_entries(session, limit=10_000)[::-1]


@pytest.fixture
def created(rig_client: httpx.Client, acting: Acting) -> int:
    wanted = {"sequence": paper() | {"steps": [HAMMER]}}
    return int(rig_client.post("/api/runs", json=wanted, headers=acting()).json()["id"])


def lease_of(client: httpx.Client, acting: Acting) -> str:
    return str(client.post("/api/rig/lease", json={"holder": "test"}, headers=acting()).json()["token"])


def test_an_action_that_moves_the_machine_is_noted_before_it_begins(
    rig_client: httpx.Client, rig: RunManager, acting: Acting, catalogue: Catalogue, created: int
) -> None:
    lease = lease_of(rig_client, acting)
    path = f"/api/runs/{created}/start"
    started = rig_client.post(path, json={"automatic": True}, headers=acting(lease=lease))
    assert started.status_code == 200, started.text
    rig.wait(LONG)
    begun, ended = entries(catalogue)[-2:]
    assert [(each.action, each.target, each.outcome) for each in (begun, ended)] == [
        ("start run", f"run {created}", "begun"), ("start run", f"run {created}", "done"),
    ]  # fmt: skip
    assert ended.details == begun.details | {"begun": begun.id}
    (moved,) = [event.at for event in rig.journal.after(0) if event.name == "RunStarted"]
    assert begun.at < moved < ended.at


def test_a_failed_action_is_noted_before_it_begins_and_with_its_reason(
    rig_client: httpx.Client, acting: Acting, catalogue: Catalogue, created: int
) -> None:
    rig_client.post(f"/api/runs/{created}/resume", headers=acting(lease=lease_of(rig_client, acting)))
    assert [entry.outcome for entry in entries(catalogue)[-2:]] == [
        "begun", f"run {created} is created; there is nothing to resume"
    ]  # fmt: skip


def test_an_action_refused_for_lack_of_scope_or_lease_is_noted_with_caller_action_and_reason(
    rig_client: httpx.Client, acting: Acting, catalogue: Catalogue, make_key: MakeKey, created: int
) -> None:
    reader, controller = make_key(Scope.READ), make_key(Scope.CONTROL)
    for secret, status in ((reader, 403), (controller, 409)):
        answer = rig_client.post(f"/api/runs/{created}/start", headers=acting(secret))
        assert answer.status_code == status
    noted = [(entry.who, entry.action, entry.target, entry.outcome) for entry in entries(catalogue)[-2:]]
    assert noted == [
        ("key 1 (test)", "start run", f"run {created}",
         "refused: this needs the scope control:rig; key 1 (test) has read:data"),
        ("key 2 (test)", "start run", f"run {created}",
         "refused: nobody drives the rig; take the control lease first"),
    ]  # fmt: skip


def test_a_caller_without_a_valid_key_is_refused_and_not_noted(
    client: httpx.Client, acting: Acting, catalogue: Catalogue, make_key: MakeKey
) -> None:
    for secret in (None, "jl_" + 43 * "x", make_key(*Scope, ended=True), make_key(*Scope, revoked=True)):
        answer = client.post("/api/keys", json={"name": "x", "scopes": ["admin"]}, headers=acting(secret))
        assert answer.status_code == 401
    assert entries(catalogue) == []


def test_reading_is_not_noted(client: httpx.Client, catalogue: Catalogue, make_key: MakeKey) -> None:
    answer = client.get("/api/keys", headers={"Authorization": f"Bearer {make_key(Scope.READ)}"})
    assert answer.status_code == 403
    assert entries(catalogue) == []


def test_a_path_that_is_not_validated_is_noted_as_plain_text(
    client: httpx.Client, acting: Acting, catalogue: Catalogue, make_key: MakeKey
) -> None:
    answer = client.post(f"/api/jobs/{'%00%0a' + 300 * 'x'}/cancel", headers=acting(make_key(Scope.READ)))
    assert answer.status_code == 403
    (entry,) = entries(catalogue)
    assert entry.target == "job %00%0A" + 94 * "x"


def test_a_key_that_may_not_act_cannot_fill_the_log(catalogue: Catalogue) -> None:
    now = 0.0
    refusals = RefusalLog(lambda: now)
    for _ in range(2 * REFUSALS_AN_HOUR):
        refusals.note(catalogue, AuditedAction("key 1", "start run", "run 1"), "why")
    refusals.note(catalogue, AuditedAction("key 2", "start run", "run 1"), "why")
    assert [entry.who for entry in entries(catalogue)] == REFUSALS_AN_HOUR * ["key 1"] + ["key 2"]
    assert entries(catalogue)[REFUSALS_AN_HOUR - 1].outcome == "refused: why; no more is noted of them within the hour"
    now = HOUR
    refusals.note(catalogue, AuditedAction("key 1", "start run", "run 1"), "why")
    assert len(entries(catalogue)) == REFUSALS_AN_HOUR + 2


def test_a_log_that_cannot_be_written_changes_no_refusal(
    impatient: None, client: httpx.Client, acting: Acting, make_key: MakeKey, tmp_path: Path
) -> None:
    secret = make_key(Scope.READ)
    with closing(sqlite3.connect(tmp_path / "jointlab.db", isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        answer = client.post("/api/runs", json={"sequence": "paper"}, headers=acting(secret))
    assert answer.status_code == 403
