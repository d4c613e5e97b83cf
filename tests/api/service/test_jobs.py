"""Jobs over REST: queued, followed, fetched, cancelled."""

import hashlib
import json
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx
import pytest

from api.service.application import create_app
from api.service.context import Services
from jointlab.client import Client
from jointlab.documents.jobs import MOST_CASES
from jointlab.jobs.executors import ProcessExecutor
from jointlab.jobs.limits import JobLimits
from jointlab.jobs.queue import JobQueue
from store.catalogue import Catalogue
from store.results.analyses import add_analysis
from store.results.diagnoses import StoredDiagnosis, add_diagnosis
from store.service.audit import add_audit_entry, list_audit_entries
from store.service.jobs import add_job, cancel_job, renew_lease, take_job
from store.states import AnalysisKind, Scope
from tests.api.service.conftest import Acting, MakeKey, served
from tests.unfit_points import without_temperature


@pytest.fixture
def jobs_client(measured: int, catalogue: Catalogue) -> Iterator[httpx.Client]:
    """A service that does jobs, in front of the demo's run."""
    with served(create_app(Services(catalogue, jobs=JobQueue(catalogue, ProcessExecutor())))) as client:
        yield client


def followed(client: httpx.Client, job: int) -> list[tuple[str, dict[str, Any]]]:
    """Names and data of the events of a job, to its end."""
    with client.stream("GET", f"/api/jobs/{job}/events") as stream:
        assert stream.headers["content-type"].startswith("text/event-stream")
        lines = list(stream.iter_lines())
    names = [line.removeprefix("event: ") for line in lines if line.startswith("event: ")]
    data = [json.loads(line.removeprefix("data: ")) for line in lines if line.startswith("data: ")]
    return list(zip(names, data, strict=True))


def test_an_export_is_queued_followed_and_fetched(
    jobs_client: httpx.Client, acting: Acting, measured: int, tmp_path: Path
) -> None:
    queued = jobs_client.post("/api/exports", json={"run": measured, "form": "hdf5"}, headers=acting())
    assert queued.status_code == 202, queued.text
    number = queued.json()["id"]
    events = followed(jobs_client, number)
    assert (events[-1][0], events[-1][1]["state"]) == ("done", "done")
    job = jobs_client.get(f"/api/jobs/{number}").json()
    file = jobs_client.get(f"/api/exports/{number}/file")
    assert (file.status_code, len(file.content)) == (200, job["result"]["bytes"])
    assert job["result"]["file"] in file.headers["content-disposition"]
    listed = jobs_client.get("/api/exports").json()["items"]
    assert [each["id"] for each in listed] == [number]
    (tmp_path / "jointlab-waveforms-exports" / job["result"]["file"]).unlink()
    assert jobs_client.get(f"/api/exports/{number}/file").status_code == 404


def test_an_export_leaves_sine_points_out_on_request_and_says_which(
    jobs_client: httpx.Client, acting: Acting, measured: int, catalogue: Catalogue, tmp_path: Path
) -> None:
    without_temperature(catalogue, measured)
    asked = {"run": measured, "form": "bundle"}
    number = jobs_client.post("/api/exports", json=asked, headers=acting()).json()["id"]
    assert followed(jobs_client, number)[-1][0] == "failed"
    error = jobs_client.get(f"/api/jobs/{number}").json()["error"]
    assert "sine point 2 cannot be exported" in error
    assert "with leave_out_unfit_points in the request such points are left out" in error
    (point,) = jobs_client.get(f"/api/jobs/{number}").json()["result"]["unfit_points"]
    assert (point["order"], point["why"]) == (2, "direct.csv needs its temperature")
    refused = jobs_client.get(f"/api/exports/{number}/file")
    assert refused.status_code == 409
    for text in (error, refused.json()["detail"]):
        assert "leave_out_unfit_points" in text
        assert "--leave-out" not in text
    asked |= {"leave_out_unfit_points": True}
    number = jobs_client.post("/api/exports", json=asked, headers=acting()).json()["id"]
    assert followed(jobs_client, number)[-1][0] == "done"
    (told,) = jobs_client.get(f"/api/jobs/{number}").json()["result"]["left_out"]
    assert told.startswith("sine point 2 (")
    assert told.endswith("was left out at the export: direct.csv needs its temperature")
    with Client(str(jobs_client.base_url)) as lab:
        assert lab.export(measured, "bundle", tmp_path / "run.zip", leave_out_unfit_points=True) == (told,)


def test_points_are_left_out_of_bundles_alone(jobs_client: httpx.Client, acting: Acting, measured: int) -> None:
    asked = {"run": measured, "form": "hdf5", "leave_out_unfit_points": True}
    answer = jobs_client.post("/api/exports", json=asked, headers=acting())
    assert answer.status_code == 422
    assert "leave_out_unfit_points belongs to the form bundle; leave it out with hdf5" in answer.text


def test_a_report_is_of_the_stored_identification(jobs_client: httpx.Client, acting: Acting, measured: int) -> None:
    asked = {"run": measured, "elements": 2}
    identified = jobs_client.post("/api/identifications", json=asked, headers=acting()).json()["id"]
    assert followed(jobs_client, identified)[-1][0] == "done"
    analysis = jobs_client.get(f"/api/jobs/{identified}").json()["result"]["likelihood_joints"]
    number = jobs_client.post("/api/exports", json={"run": measured, "form": "report"}, headers=acting()).json()["id"]
    assert followed(jobs_client, number)[-1][0] == "done"
    page = jobs_client.get(f"/api/exports/{number}/file").text
    assert f"Chosen by hand: elements between nodes: 2. It is that of analysis {analysis}." in page


def test_a_report_is_signed_by_the_name_of_the_request(
    jobs_client: httpx.Client, acting: Acting, measured: int, catalogue: Catalogue, tmp_path: Path
) -> None:
    asked = {"run": measured, "form": "report", "signed_by": "Ann Miller"}
    queued = jobs_client.post("/api/exports", json=asked, headers=acting()).json()
    assert queued["parameters"] == asked
    with catalogue.reading() as session:
        assert list_audit_entries(session, action="sign report") == []  # there is no report yet
    assert followed(jobs_client, queued["id"])[-1][0] == "done"
    file = jobs_client.get(f"/api/exports/{queued['id']}/file").content
    assert b"<td>signed by</td><td>Ann Miller, at " in file
    with catalogue.reading() as session:
        (entry,) = list_audit_entries(session, action="sign report")
    assert (entry.who, entry.target, entry.outcome) == (queued["asked_by"], f"run {measured}", "done")
    assert entry.details == {"signed_by": "Ann Miller", "checksum": hashlib.sha256(file).hexdigest()}
    assert f"; command given by {queued['asked_by']}</td>" in file.decode()
    with Client(str(jobs_client.base_url)) as lab:
        lab.export(measured, "report", tmp_path / "report.html", signed_by="Bob")
    assert "<td>signed by</td><td>Bob, at " in (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"form": "hdf5", "signed_by": "Ann"}, "signed_by belongs to the forms report and report-pdf; leave it out"),
        ({"form": "report", "signed_by": "Ann\nMiller"}, "characters in one line"),
        ({"form": "report-pdf", "signed_by": ""}, "characters in one line"),
    ],
)
def test_reports_alone_are_signed_and_by_a_name(
    jobs_client: httpx.Client, acting: Acting, measured: int, given: dict[str, str], words: str
) -> None:
    answer = jobs_client.post("/api/exports", json={"run": measured, **given}, headers=acting())
    assert answer.status_code == 422
    assert words in answer.text


def test_a_job_that_is_cancelled_is_over_at_once(jobs_client: httpx.Client, acting: Acting, measured: int) -> None:
    queued = jobs_client.post("/api/identifications", json={"run": measured}, headers=acting()).json()
    cancelled = jobs_client.post(f"/api/jobs/{queued['id']}/cancel", headers=acting())
    assert (cancelled.status_code, cancelled.json()["state"]) == (200, "cancelled")
    assert [name for name, _ in followed(jobs_client, queued["id"])] == ["cancelled"]
    listed = jobs_client.get("/api/jobs", params={"state": "cancelled", "kind": "identify"}).json()["items"]
    assert [each["id"] for each in listed] == [queued["id"]]


def test_a_running_job_tells_what_it_has_found_so_far_and_one_that_is_over_does_not(
    client: httpx.Client, catalogue: Catalogue
) -> None:
    answer = "first answer, not final: mass at the joints (joint_mass), explains 40 % of the misfit"
    with catalogue.writing() as session:
        job = add_job(session, "diagnose", {"run": 1}, "ann")
        taken = take_job(session, ["diagnose"])
        assert taken is not None
        renew_lease(session, job.id, taken[1], "diagnosis", 42, 100, answer)
    assert client.get(f"/api/jobs/{job.id}").json()["now"] == answer
    assert [each["now"] for each in client.get("/api/jobs").json()["items"]] == [answer]
    with client.stream("GET", f"/api/jobs/{job.id}/events") as stream:
        told = (json.loads(line.removeprefix("data: ")) for line in stream.iter_lines() if line.startswith("data: "))
        assert next(told)["now"] == answer
        with catalogue.writing() as session:
            cancel_job(session, job.id)
        assert [(each["state"], each["stage"], each["now"]) for each in told] == [("cancelled", "diagnosis", None)]


@pytest.mark.parametrize("path", ["identifications", "diagnoses", "exports"])
def test_a_job_for_a_run_that_is_not_there_is_refused(jobs_client: httpx.Client, acting: Acting, path: str) -> None:
    body = {"run": 77} | ({"form": "bundle"} if path == "exports" else {})
    answer = jobs_client.post(f"/api/{path}", json=body, headers=acting())
    assert (answer.status_code, answer.json()["detail"]) == (404, "there is no run 77")
    assert jobs_client.get("/api/jobs").json()["items"] == []


def test_a_suspended_beam_that_is_not_there_is_refused(
    jobs_client: httpx.Client, acting: Acting, measured: int
) -> None:
    body = {"run": measured, "free_beam": 77}
    answer = jobs_client.post("/api/identifications", json=body, headers=acting())
    assert (answer.status_code, answer.json()["detail"]) == (404, "there is no run 77")
    queued = jobs_client.post(
        "/api/identifications", json={"run": measured, "free_beam": measured, "elements": 1}, headers=acting()
    )
    assert queued.status_code == 202
    assert queued.json()["parameters"] == {"run": measured, "free_beam": measured, "elements": 1}


def test_the_options_of_an_average_reach_the_job(jobs_client: httpx.Client, acting: Acting, measured: int) -> None:
    body = {"run": measured, "estimator": "Hv", "force_window": 0.05, "exponential_window": 0.5}
    queued = jobs_client.post("/api/identifications", json=body, headers=acting())
    assert (queued.status_code, queued.json()["parameters"]) == (202, body)
    for wrong in ({"estimator": "H3"}, {"exponential_window": 0.001}, {"force_window": 0}):
        refused = jobs_client.post("/api/identifications", json=body | wrong, headers=acting())
        assert refused.status_code == 422


@pytest.mark.parametrize("path", ["/api/jobs/7", "/api/jobs/7/events", "/api/exports/7/file"])
def test_a_job_that_is_not_there_is_not_found(client: httpx.Client, path: str) -> None:
    answer = client.get(path)
    assert (answer.status_code, answer.json()["detail"]) == (404, "there is no job 7")


def test_diagnoses_are_listed_and_shown_whole(measured: int, client: httpx.Client, catalogue: Catalogue) -> None:
    document = {"format": "jointlab-diagnosis/1", "verdict": {"status": "explained", "effects": ["sensor_mass"]}}
    with catalogue.writing() as session:
        kind = AnalysisKind.DIAGNOSES
        number = add_analysis(session, kind=kind, method="test", settings={}, runs=[measured])
        add_diagnosis(session, StoredDiagnosis(number, "explained", ("sensor_mass",), 12.3, 3.1, document=document))
    (listed,) = client.get("/api/diagnoses", params={"run": measured}).json()["items"]
    assert (listed["id"], listed["status"], listed["effects"]) == (number, "explained", ["sensor_mass"])
    whole = client.get(f"/api/diagnoses/{number}").json()
    assert whole == listed | {"document": document}
    assert client.get("/api/diagnoses", params={"run": 99}).json()["items"] == []
    assert client.get("/api/diagnoses/99").status_code == 404


def test_a_trial_is_queued_as_a_job(jobs_client: httpx.Client, acting: Acting, measured: int) -> None:
    queued = jobs_client.post("/api/trials", json={"cases": 2, "seed": 1}, headers=acting())
    assert (queued.status_code, queued.json()["parameters"]) == (202, {"cases": 2, "seed": 1})
    jobs_client.post(f"/api/jobs/{queued.json()['id']}/cancel", headers=acting())
    assert [each["kind"] for each in jobs_client.get("/api/trials").json()["items"]] == ["trial"]


def test_a_job_that_is_under_way_is_not_queued_again(jobs_client: httpx.Client, acting: Acting, measured: int) -> None:
    queued = jobs_client.post("/api/diagnoses", json={"run": measured}, headers=acting())
    assert queued.status_code == 202
    again = jobs_client.post("/api/diagnoses", json={"run": measured}, headers=acting())
    assert (again.status_code, again.json()["detail"]) == (
        409, f"job {queued.json()['id']} does that already; wait for it, or cancel it",
    )  # fmt: skip
    jobs_client.post(f"/api/jobs/{queued.json()['id']}/cancel", headers=acting())
    later = jobs_client.post("/api/diagnoses", json={"run": measured}, headers=acting())
    assert later.status_code == 202
    jobs_client.post(f"/api/jobs/{later.json()['id']}/cancel", headers=acting())


def test_a_service_without_jobs_says_so(client: httpx.Client, acting: Acting) -> None:
    answer = client.post("/api/trials", json={"cases": 2}, headers=acting())
    assert (answer.status_code, "does no jobs" in answer.json()["detail"]) == (409, True)


def test_a_key_that_has_too_many_jobs_is_told_so(
    measured: int, catalogue: Catalogue, acting: Acting, make_key: MakeKey
) -> None:
    queue = JobQueue(catalogue, ProcessExecutor(), JobLimits(open_jobs=2))
    ann, bob = make_key(Scope.ANALYSE), make_key(Scope.ANALYSE)
    with served(create_app(Services(catalogue, jobs=queue))) as client:
        asked = [client.post("/api/trials", json={"cases": 1, "seed": n}, headers=acting(ann)) for n in range(1, 4)]
        other = client.post("/api/trials", json={"cases": 1, "seed": 4}, headers=acting(bob))
        assert [each.status_code for each in (*asked, other)] == [202, 202, 429, 202]
        assert "are not over" in asked[-1].json()["detail"]
        for each in (*asked[:2], other):
            client.post(f"/api/jobs/{each.json()['id']}/cancel", headers=acting(ann))


def test_a_trial_of_too_many_cases_is_refused(jobs_client: httpx.Client, acting: Acting) -> None:
    assert jobs_client.post("/api/trials", json={"cases": MOST_CASES + 1}, headers=acting()).status_code == 422


def test_rows_that_have_half_of_a_surrogate_pair_are_read_with_a_replacement(
    client: httpx.Client, catalogue: Catalogue, tmp_path: Path
) -> None:
    with catalogue.writing() as session:
        job = add_job(session, "export", {"run": 1, "form": "report", "signed_by": "bad-name"}, "test").id
        add_audit_entry(session, who="a", action="b", target="c", outcome="d", details={"signed_by": "bad-name"})
    with closing(sqlite3.connect(tmp_path / "jointlab.db")) as other:  # as an earlier version has stored it
        (guard,) = other.execute(
            "SELECT name, sql FROM sqlite_schema WHERE type = 'trigger' AND sql LIKE '%UPDATE%audit_entries%'"
        )
        other.execute(f"DROP TRIGGER {guard[0]}")
        for table, column in (("jobs", "parameters"), ("audit_entries", "details")):
            other.execute(f"UPDATE {table} SET {column} = replace({column}, '-name', '\\ud800')")
        other.execute(guard[1])
        other.commit()
    for path in ("/api/jobs", "/api/exports"):
        answer = client.get(path)
        assert (answer.status_code, answer.json()["items"][0]["parameters"]["signed_by"]) == (200, "bad\ufffd"), path
    assert client.get(f"/api/jobs/{job}").json()["parameters"]["signed_by"] == "bad\ufffd"
    assert client.get("/api/audit").json()["items"][0]["details"] == {"signed_by": "bad\ufffd"}
