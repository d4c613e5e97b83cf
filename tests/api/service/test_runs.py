"""Runs over REST: lists, and a whole life from creation to the end, driven by the client with the lease."""

from copy import deepcopy
from datetime import UTC, datetime
from typing import Any
from unittest.mock import Mock

import httpx
import pytest

from jointlab.drive.phase import Phase
from jointlab.identification.load import measurement_of_run
from jointlab.supervision.manager import RunManager
from rig.errors import RigError
from simlab.laboratory import Laboratory
from store.catalogue import Catalogue
from store.errors import StoreError
from store.measurements.runs import finish_run, start_run
from store.service.audit import AuditEntry, list_audit_entries
from store.states import RunState, Scope
from tests.api.conftest import paper
from tests.api.service.conftest import Acting, MakeKey
from tests.rig.conftest import DOCUMENT
from tests.waiting import LONG, until


@pytest.fixture
def small() -> dict[str, Any]:
    """The paper's sequence with two points of two blows and two sine points."""
    return paper() | {"steps": deepcopy(DOCUMENT["steps"])}


@pytest.fixture
def lease(rig_client: httpx.Client, acting: Acting) -> str:
    answer = rig_client.post("/api/rig/lease", json={"holder": "test"}, headers=acting())
    assert answer.status_code == 201
    return str(answer.json()["token"])


@pytest.fixture
def created(rig_client: httpx.Client, acting: Acting, small: dict[str, Any]) -> int:
    answer = rig_client.post("/api/runs", json={"sequence": small}, headers=acting())
    assert (answer.status_code, answer.json()["state"]) == (201, "created"), answer.text
    assert answer.json()["started_at"] is None
    return int(answer.json()["id"])


def test_a_run_without_a_result_is_told_in_words(client: httpx.Client, catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        run = start_run(session, kind="import", title="t", article="beam 3", setup={}).id
    answer = client.get(f"/api/runs/{run}/modes")
    assert (answer.status_code, answer.json()["detail"]) == (
        404, f"run {run} has no modes; identify or diagnose it first, if that was measured",
    )  # fmt: skip


def test_runs_are_found_by_a_part_of_their_title_however_many_newer_ones_there_are(
    client: httpx.Client, catalogue: Catalogue
) -> None:
    with catalogue.writing() as session:
        for title in ("The 100 % beam", *(f"run {n}" for n in range(3)), "a beam"):
            start_run(session, kind="import", title=title, article="beam 3", setup={})
    for text, titles in (("BEAM", ["a beam", "The 100 % beam"]), ("0 %", ["The 100 % beam"]), ("r%n", [])):
        found = client.get("/api/runs", params={"text": text, "limit": 2}).json()["items"]
        assert [run["title"] for run in found] == titles


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("/runs?kind=foo", "it has to be 'sequence' or 'import'"),
        ("/runs?since=2026-02-01&until=2026-01-01", "since 2026-02-01 is beyond until 2026-01-01"),
        ("/jobs?kind=foo", "it has to be 'master', 'diagnose', 'investigate', 'identify', 'export' or 'trial'"),
        ("/comparisons?article=a&verdict=agrees", "it has to be 'agree', 'differ' or 'not comparable'"),
        ("/dynamic-stiffness?article=a&configuration=twist", "it has to be 'compression', 'shear' or 'angled'"),
        ("/dynamic-stiffness?article=a&lowest_frequency=9&highest_frequency=8", "lowest_frequency 9.0 is beyond"),
    ],
)
def test_a_filter_that_nothing_can_fit_is_refused_with_what_it_may_be(
    client: httpx.Client, path: str, words: str
) -> None:
    refused = client.get(f"/api{path}")
    assert (refused.status_code, words in refused.json()["detail"]) == (422, True), refused.text


def test_a_wrong_sequence_is_told_in_words_of_the_form_that_was_given(
    rig_client: httpx.Client, acting: Acting, small: dict[str, Any]
) -> None:
    for given, words in (
        (
            small | {"steps": [small["steps"][0] | {"blows": "ten"}]},
            ".document.steps.0.hammer.blows: is 'ten', which is",
        ),
        (small | {"article": small["article"] | {"colour": 1}}, ".document.article.colour: there is no such key"),
        ("a/b", ".name: is 'a/b'; write 1 to 100 letters, digits, spaces, dots"),
        (7, ": is neither the name of a sequence nor an object with named values"),
    ):
        refused = rig_client.post("/api/runs", json={"sequence": given}, headers=acting())
        assert refused.status_code == 422
        assert refused.json()["detail"].startswith(f"body.sequence{words}"), refused.text
    kept = small | {"article": small["article"] | {"colour": 1}}
    refused = rig_client.put("/api/sequences/mine", json=kept, headers=acting())
    assert (refused.status_code, refused.json()["detail"]) == (422, "body.article.colour: there is no such key")


def test_a_body_that_is_no_json_is_told_so(rig_client: httpx.Client, acting: Acting) -> None:
    headers = acting() | {"Content-Type": "application/json"}
    refused = rig_client.post("/api/runs", content=b'{"sequence": }', headers=headers)
    assert (refused.status_code, refused.json()["detail"]) == (422, "body.13: is no JSON: Expecting value")


def test_a_run_whose_channel_is_not_there_or_too_small_is_not_planned(
    rig_client: httpx.Client, acting: Acting, small: dict[str, Any]
) -> None:
    for changes, words in (
        ({"hammer": "hammer2"}, "no channel hammer2 in the channel table; it has hammer, accelerometer"),
        ({"peak_force": 4900.0}, "channel 'hammer' ends at 2000 N, below the peak_force 4900 N"),
    ):
        document = small | {"steps": [small["steps"][0] | changes]}
        refused = rig_client.post("/api/runs", json={"sequence": document}, headers=acting())
        assert (refused.status_code, words in refused.json()["detail"]) == (422, True), refused.text
    assert rig_client.get("/api/runs").json()["items"] == []


def test_a_run_that_does_not_begin_is_created_for_the_rig_too(
    rig_client: httpx.Client, rig: RunManager, acting: Acting, lease: str, created: int, laboratory: Laboratory
) -> None:
    laboratory.daq.faults.set("device_gone")
    assert rig_client.post(f"/api/runs/{created}/start", headers=acting(lease=lease)).status_code == 502
    assert rig.wait(LONG)
    shown = rig_client.get("/api/rig").json()
    assert (shown["run_id"], shown["ended_as"]) == (created, "created")
    assert shown["reason"]
    assert rig_client.get(f"/api/runs/{created}").json()["state"] == "created"


def test_runs_come_newest_first_in_pages_and_by_state(client: httpx.Client, catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        for number in range(1, 6):
            run = start_run(session, kind="hammer", title=f"run {number}", article="beam 3", setup={})
            if number % 2:
                finish_run(session, run.id, RunState.FAILED, "nobody struck")
    first = client.get("/api/runs", params={"limit": 2}).json()
    second = client.get("/api/runs", params={"limit": 2, "cursor": first["next"]}).json()
    third = client.get("/api/runs", params={"limit": 2, "cursor": second["next"]}).json()
    assert [[run["id"] for run in page["items"]] for page in (first, second, third)] == [[5, 4], [3, 2], [1]]
    assert third["next"] is None
    failed = client.get("/api/runs", params={"state": "failed"}).json()["items"]
    assert [(run["id"], run["reason"]) for run in failed] == [(n, "nobody struck") for n in (5, 3, 1)]
    assert client.get("/api/runs", params={"article": "none"}).json() == {"items": [], "next": None}


@pytest.mark.parametrize(
    ("days", "found"),
    [
        ({"since": "2026-03-02"}, [3, 2]),
        ({"until": "2026-03-02"}, [2, 1]),
        ({"since": "2026-03-02", "until": "2026-03-02"}, [2]),
        ({"since": "0001-01-01", "until": "9999-12-31"}, [3, 2, 1]),
    ],
)
def test_runs_are_listed_from_one_day_to_another(
    client: httpx.Client, catalogue: Catalogue, days: dict[str, str], found: list[int]
) -> None:
    with catalogue.writing() as session:
        for day in (1, 2, 3):
            began = datetime(2026, 3, day, 23, 59, tzinfo=UTC)
            start_run(session, kind="hammer", title="t", article="beam 3", setup={}, started_at=began)
    assert [run["id"] for run in client.get("/api/runs", params=days).json()["items"]] == found


@pytest.mark.parametrize("day", ["0", "2026-02-30", "20260302", "yesterday"])
def test_what_is_no_day_is_refused(client: httpx.Client, day: str) -> None:
    answer = client.get("/api/runs", params={"since": day})
    assert (answer.status_code, "since" in answer.json()["detail"]) == (422, True), answer.text


def test_a_known_document_is_not_sent_again(client: httpx.Client, catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        run = start_run(session, kind="hammer", title="t", article="beam 3", setup={})
    tag = client.get("/api/runs/1").headers["etag"]
    again = client.get("/api/runs/1", headers={"If-None-Match": tag})
    assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", tag)
    with catalogue.writing() as session:
        finish_run(session, run.id, RunState.FINISHED)
    changed = client.get("/api/runs/1", headers={"If-None-Match": tag})
    assert (changed.status_code, changed.json()["state"]) == (200, "finished")
    assert changed.headers["etag"] != tag


def test_a_run_is_created_started_and_measured_to_its_end(
    rig_client: httpx.Client, rig: RunManager, acting: Acting, lease: str, created: int
) -> None:
    started = rig_client.post(f"/api/runs/{created}/start", json={"automatic": True}, headers=acting(lease=lease))
    assert (started.status_code, started.json()["state"]) == (200, "running"), started.text
    assert rig.wait(LONG)
    state = rig_client.get("/api/rig").json()
    assert (state["phase"], state["ended_as"], state["blows"], state["sines"]) == ("idle", "finished", 4, 2)
    history = rig_client.get(f"/api/runs/{created}/history").json()["items"]
    assert [event["state"] for event in history] == ["created", "running", "finished"]


def test_the_article_of_a_run_is_amended_once_and_read_again(
    client: httpx.Client, catalogue: Catalogue, acting: Acting
) -> None:
    with catalogue.writing() as session:
        run = start_run(session, kind="import", title="t", article="beam 3", setup=paper()["article"])
    headers, path = acting(), f"/api/runs/{run.id}/amendments"
    asked = {"article": {"beam": {"density": 7810.0}}, "reason": "weighed again"}
    made = client.post(path, json=asked, headers=headers)
    assert (made.status_code, made.json()["version"]) == (201, 2), made.text
    assert client.post(path, json=asked, headers=headers).json() == made.json()
    assert client.get(path).json()["items"] == [made.json()]
    details = client.get(f"/api/runs/{run.id}").json()
    assert (details["setup_version"], details["setup"]["beam"]["density"]) == (2, 7810.0)
    wrong = asked | {"article": {"beam": {"length": 2.0}}}
    refused = client.post(path, json=wrong, headers=acting())
    assert (refused.status_code, "make them agree" in refused.json()["detail"]) == (422, True), refused.text
    infinite = b'{"article": {"beam": {"length": 1e999}}, "reason": "r"}'
    refused = client.post(path, content=infinite, headers=acting() | {"Content-Type": "application/json"})
    words = f"the amended article of run {run.id}: beam.length: is inf, which is no finite number"
    assert (refused.status_code, refused.json()["detail"]) == (422, words)
    assert catalogue.read(list_audit_entries)[0].outcome == words


def test_a_request_that_is_sent_twice_acts_once(
    rig_client: httpx.Client, catalogue: Catalogue, acting: Acting, small: dict[str, Any]
) -> None:
    headers = acting()
    first = rig_client.post("/api/runs", json={"sequence": small}, headers=headers)
    again = rig_client.post("/api/runs", json={"sequence": small}, headers=headers)
    assert (again.status_code, again.json()) == (201, first.json())
    assert again.headers["idempotency-replayed"] == "true"
    other = rig_client.post("/api/runs", json={"sequence": "paper"}, headers=headers)
    assert other.status_code == 409
    assert "was used for another request" in other.json()["detail"]
    assert len(rig_client.get("/api/runs").json()["items"]) == 1


def test_a_request_that_failed_may_be_sent_again(
    rig_client: httpx.Client, acting: Acting, lease: str, created: int
) -> None:
    headers = acting(lease="wrong")
    path = f"/api/runs/{created}/start"
    assert rig_client.post(path, json={"automatic": True}, headers=headers).status_code == 409
    headers["Control-Lease"] = lease
    assert rig_client.post(path, json={"automatic": True}, headers=headers).status_code == 200


def test_no_run_is_started_or_driven_without_the_lease(rig_client: httpx.Client, acting: Acting, created: int) -> None:
    for action in ("start", "pause", "resume", "answer", "acknowledge-interlock"):
        body = {"answer": {"prompt": 1}, "acknowledge-interlock": {"reason": "removed"}}.get(action)
        answer = rig_client.post(f"/api/runs/{created}/{action}", json=body, headers=acting())
        assert answer.status_code == 409, action
        assert "take the control lease first" in answer.json()["detail"]


def test_a_request_that_drives_gets_its_first_answer_again_when_its_lease_has_ended(
    rig_client: httpx.Client, rig: RunManager, acting: Acting, lease: str, created: int, make_key: MakeKey
) -> None:
    path, body, headers = f"/api/runs/{created}/start", {"automatic": True}, acting(lease=lease)
    started = rig_client.post(path, json=body, headers=headers)
    assert (started.status_code, started.json()["state"]) == (200, "running"), started.text
    rig.stop()
    rig.wait(LONG)
    rig_client.delete("/api/rig/lease", headers=acting(lease=lease))

    again = rig_client.post(path, json=body, headers=headers)
    assert (again.status_code, again.json()) == (200, started.json())
    assert again.headers["idempotency-replayed"] == "true"
    other = rig_client.post(f"/api/runs/{created}/resume", json=body, headers=headers)
    assert (other.status_code, "was used for another request" in other.json()["detail"]) == (409, True)
    stranger = headers | {"Authorization": f"Bearer {make_key(Scope.CONTROL)}"}
    refused = rig_client.post(path, json=body, headers=stranger)
    assert (refused.status_code, "take the control lease first" in refused.json()["detail"]) == (409, True)
    assert rig.state.phase is Phase.IDLE


def test_one_rig_has_one_driver_at_a_time(rig_client: httpx.Client, acting: Acting, lease: str) -> None:
    taken = rig_client.post("/api/rig/lease", json={"holder": "another"}, headers=acting())
    assert taken.status_code == 409
    assert taken.json()["detail"].startswith("test drives the rig for another 60 s or longer")
    assert "you may take over" in taken.json()["detail"]
    assert rig_client.put("/api/rig/lease", headers={"Control-Lease": lease}).status_code == 200
    assert rig_client.delete("/api/rig/lease", headers={"Control-Lease": lease}).status_code == 422
    back = acting(lease=lease)
    for _ in range(2):  # asked for twice, it is given back once
        assert rig_client.delete("/api/rig/lease", headers=back).status_code == 204
    assert rig_client.post("/api/rig/lease", json={"holder": "another"}, headers=acting()).status_code == 201


def test_a_technician_is_prompted_and_waited_for(
    rig_client: httpx.Client, rig: RunManager, acting: Acting, lease: str, created: int
) -> None:
    rig_client.post(f"/api/runs/{created}/start", headers=acting(lease=lease))
    asked: list[dict[str, Any]] = []
    while rig_client.get("/api/rig").json()["phase"] != "idle":
        prompt = rig_client.get("/api/rig").json()["prompt"]
        if prompt is not None and prompt["number"] not in [each["number"] for each in asked]:
            asked.append(prompt)
            path = f"/api/runs/{created}/answer"
            given = {"prompt": prompt["number"]}
            assert rig_client.post(path, json=given, headers=acting(lease=lease)).status_code == 200
            assert rig_client.post(path, json=given, headers=acting(lease=lease)).status_code == 409
    assert [prompt["kind"] for prompt in asked] == ["go", "strike", "strike", "go", "strike", "strike", "mount"]
    assert rig.wait(LONG)
    assert rig_client.get(f"/api/runs/{created}").json()["state"] == "finished"


def test_a_run_that_is_not_there_is_not_found_whatever_is_done_with_it(
    rig_client: httpx.Client, acting: Acting, lease: str, created: int
) -> None:
    for action, body in (("pause", None), ("resume", None), ("start", None), ("answer", {"prompt": 1})):
        answer = rig_client.post(f"/api/runs/99/{action}", json=body, headers=acting(lease=lease))
        assert (answer.status_code, answer.json()["detail"]) == (404, "there is no run 99"), action
    waiting = rig_client.post(f"/api/runs/{created}/pause", headers=acting(lease=lease))
    assert waiting.status_code == 409


def test_a_run_is_paused_stopped_and_resumed(
    rig_client: httpx.Client, rig: RunManager, acting: Acting, lease: str, created: int
) -> None:
    run = f"/api/runs/{created}"
    rig_client.post(f"{run}/start", headers=acting(lease=lease))  # waits for the first blow to be struck
    assert rig_client.post(f"{run}/pause", headers=acting(lease=lease)).status_code == 200
    unnamed = rig_client.post(f"{run}/resume", headers=acting(lease=lease))
    assert (unnamed.status_code, "`pause` in the state of the rig" in unnamed.json()["detail"]) == (409, True)
    shown = rig_client.get("/api/rig").json()
    named = {"pause": shown["pause"], "stop_epoch": shown["stop_epoch"]}
    assert rig_client.post(f"{run}/resume", json=named, headers=acting(lease=lease)).status_code == 200
    late = rig_client.post(f"{run}/resume", json=named, headers=acting(lease=lease))
    assert late.status_code == 409
    stopped = rig_client.post(f"{run}/stop", headers=acting())
    assert (stopped.status_code, stopped.json()["state"]) == (200, "stopped"), stopped.text
    history = rig_client.get(f"{run}/history").json()["items"]
    assert [event["who"] for event in history] == [history[0]["who"]] * 3  # not the process of the rig
    assert rig_client.post(f"{run}/pause", headers=acting(lease=lease)).status_code == 409
    resumed = rig_client.post(f"{run}/resume", json={"automatic": True}, headers=acting(lease=lease))
    assert resumed.status_code == 200, resumed.text
    assert rig.wait(LONG)
    assert rig_client.get(run).json()["state"] == "finished"


def test_a_start_that_was_decided_before_a_stop_does_not_begin_after_it(
    rig_client: httpx.Client, rig: RunManager, acting: Acting, lease: str, created: int
) -> None:
    seen = rig_client.get("/api/rig").json()["stop_epoch"]
    rig_client.post("/api/rig/stop")
    assert rig.stopped_by is not None
    rig_client.post("/api/rig/reset-stop", json={"epoch": rig.stopped_by.epoch}, headers=acting(lease=lease))
    late = rig_client.post(f"/api/runs/{created}/start", json={"stop_epoch": seen}, headers=acting(lease=lease))
    assert (late.status_code, late.json()["detail"].startswith("STOP was pressed since")) == (409, True)
    assert rig.state.run_id is None


def test_a_stop_that_is_not_confirmed_is_told_although_it_cannot_be_noted(
    rig_client: httpx.Client,
    rig: RunManager,
    catalogue: Catalogue,
    acting: Acting,
    created: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(rig, "end_run", Mock(side_effect=RigError("the actuator was not confirmed at rest")))
    with monkeypatch.context() as away:
        away.setattr(catalogue, "writing", Mock(side_effect=StoreError("the database does not answer")))
        answer = rig_client.post(f"/api/runs/{created}/stop", headers=acting())
    assert (answer.status_code, answer.json()["detail"]) == (
        502, "the actuator was not confirmed at rest; the database does not answer"
    )  # fmt: skip


def test_who_has_pressed_stop_is_told_by_where_the_press_came_from(rig_client: httpx.Client) -> None:
    assert rig_client.post("/api/rig/stop").status_code == 200
    stop = rig_client.get("/api/rig").json()["stop"]
    assert (stop["who"], stop["why"]) == ("the page or a program at 127.0.0.1", "STOP was pressed")


def test_a_run_that_was_begun_automatically_is_resumed_so(
    rig_client: httpx.Client, rig: RunManager, acting: Acting, lease: str, small: dict[str, Any]
) -> None:
    small["steps"] = [small["steps"][1] | {"frequencies": {"first": 20, "last": 200, "step": 0.02}}]
    created = rig_client.post("/api/runs", json={"sequence": small}, headers=acting()).json()["id"]
    run = f"/api/runs/{created}"
    rig_client.post(f"{run}/start", json={"automatic": True}, headers=acting(lease=lease))
    until(lambda: rig.state.sines > 0)
    rig_client.post(f"{run}/stop", headers=acting())
    measured = rig.state.sines
    rig_client.post(f"{run}/resume", headers=acting(lease=lease))
    until(lambda: rig.state.sines > measured)  # what was to be mounted is
    rig_client.post(f"{run}/stop", headers=acting())


def test_stop_needs_neither_key_nor_lease_and_may_be_repeated(
    rig_client: httpx.Client, acting: Acting, lease: str, created: int
) -> None:
    rig_client.post(f"/api/runs/{created}/start", headers=acting(lease=lease))
    assert rig_client.post("/api/rig/stop").json() == {"run_id": created}
    for _ in range(3):
        assert rig_client.post("/api/rig/stop").status_code == 200


def test_actions_that_moved_the_machine_are_in_the_audit_log(
    rig_client: httpx.Client, catalogue: Catalogue, acting: Acting, lease: str, created: int
) -> None:
    rig_client.post(f"/api/runs/{created}/answer", json={"prompt": 1}, headers=acting(lease=lease))
    rig_client.post("/api/rig/stop")
    entries: list[AuditEntry] = []
    while not (entries and entries[0].action == "stop"):  # it is noted when it is done
        with catalogue.reading() as session:
            entries = list_audit_entries(session)
    assert [(entry.action, entry.target) for entry in entries] == [
        ("stop", "rig"), ("answer prompt", f"run {created}"), ("answer prompt", f"run {created}"),
        ("create run", "new run"), ("take lease", "rig"),
    ]  # fmt: skip
    assert [entry.outcome for entry in entries[1:3]] == [f"run {created} is not being carried out here", "begun"]
    assert all(entry.who for entry in entries)


def test_a_withdrawn_blow_is_struck_again_and_counts_with_those_of_its_point(
    rig_client: httpx.Client, rig: RunManager, catalogue: Catalogue, acting: Acting, lease: str, created: int
) -> None:
    rig_client.post(f"/api/runs/{created}/start", headers=acting(lease=lease))
    withdrawn = None
    while (state := rig_client.get("/api/rig").json())["phase"] != "idle":
        if withdrawn is None and state["blows"] == 2 and (state["prompt"] or {}).get("kind") == "go":
            while len(blows := rig_client.get(f"/api/runs/{created}/blows").json()["items"]) < 2:
                pass  # a blow counts before it is in the database
            path = f"/api/blows/{blows[1]['id']}/withdraw"
            withdrawn = rig_client.post(path, json={"reason": "struck beside"}, headers=acting())
            assert (withdrawn.status_code, withdrawn.json()["accepted"]) == (200, False)
            assert rig_client.post(path, json={"reason": "again"}, headers=acting()).status_code == 409
            assert rig_client.get("/api/rig").json()["blows"] == 1
        if state["prompt"] is not None:
            given = {"prompt": state["prompt"]["number"]}
            rig_client.post(f"/api/runs/{created}/answer", json=given, headers=acting(lease=lease))
    blows = rig_client.get(f"/api/runs/{created}/blows").json()["items"]
    assert [(blow["point"], blow["number"], blow["accepted"]) for blow in blows] == [
        ("5y", 1, True), ("5y", 2, False), ("1x", 1, True), ("1x", 2, True), ("5y", 3, True),
    ]  # fmt: skip
    assert blows[1]["reason"] == "withdrawn: struck beside"
    assert rig_client.get("/api/rig").json()["blows"] == 4
    measurement = measurement_of_run(catalogue, created)
    assert [str(point) for point in measurement.sets[0].inputs] == ["5y", "1x"]
    assert [each.force.shape[0] for each in measurement.forces[1]] == [2, 2]
