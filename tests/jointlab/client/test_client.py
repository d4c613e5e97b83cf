"""The typed client against a service on simulated instruments, and the example that is written with it."""

import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from datetime import date
from pathlib import Path
from typing import Any

import httpx
import pytest
import yaml

from api.service.application import create_app
from api.service.context import Services
from jointlab.client import Client, ProblemError
from jointlab.documents.commissioning import ExaminationRequest
from jointlab.supervision.manager import RunManager
from rig.checks.check import CheckState, Place
from store.catalogue import Catalogue
from store.measurements.runs import start_run
from store.states import RunState, Scope, Verdict
from tests.api.commands.test_service import serving
from tests.api.conftest import paper
from tests.api.service.conftest import MakeKey, served

EXAMPLE = Path(__file__).resolve().parents[3] / "docs" / "examples" / "automated_sequence.py"
SMALL = {"step": "hammer", "points": ["5y", "1x"], "blows": 2, "block_seconds": 1.0}


@pytest.fixture
def lab(rig_client: httpx.Client) -> Iterator[Client]:
    with Client(str(rig_client.base_url)) as lab:
        yield lab


def small() -> dict[str, Any]:
    return paper() | {"steps": [SMALL]}


def test_a_run_is_driven_from_its_creation_to_its_end(lab: Client, rig: RunManager) -> None:
    assert lab.health().drives_a_rig
    assert lab.ready().status == "ready"
    run = lab.create_run(small())
    with lab.driving("test") as driver:
        assert lab.rig().driven_by == "test"
        assert driver.start(run.id, automatic=True).state is RunState.RUNNING
        assert lab.wait_for_run(run.id).state is RunState.FINISHED
    assert lab.rig().driven_by is None
    blows = list(lab.blows(run.id, accepted=True))
    assert [blow.point for blow in blows] == ["5y", "5y", "1x", "1x"]
    assert len(lab.blow_waveform(blows[0].id).traces) == 2
    assert [found.id for found in lab.runs(state=RunState.FINISHED)] == [run.id]
    assert run.id in [found.id for found in lab.runs(since=date(2026, 1, 1))]
    withdrawn = lab.withdraw_blow(blows[0].id, "struck beside")
    assert (withdrawn.accepted, withdrawn.reason) == (False, "withdrawn: struck beside")
    assert [blow.id for blow in lab.blows(run.id, accepted=True)] == [blow.id for blow in blows[1:]]
    assert list(lab.runs(until=date(2026, 1, 1))) == list(lab.runs(specimen="no such joint")) == []


def test_a_second_client_takes_over_only_by_force(lab: Client) -> None:
    run = lab.create_run(small())
    with lab.driving("first") as first:
        with pytest.raises(ProblemError, match="first drives the rig"), lab.driving("second"):
            raise AssertionError("two clients drive")
        with lab.driving("second", by_force=True):
            assert lab.rig().driven_by == "second"
            with pytest.raises(ProblemError, match="second drives the rig"):
                first.start(run.id, automatic=True)
    assert lab.rig().driven_by is None


def test_events_come_as_they_happen_and_continue_after_a_lost_connection(lab: Client) -> None:
    run = lab.create_run(small())
    with lab.events() as events, lab.driving("test") as driver:
        driver.start(run.id, automatic=True)
        first = next(event for event in events if event.name == "BlowAccepted")
    lab.wait_for_run(run.id)
    names = []
    with lab.events(last_event_id=first.id) as events:
        for event in events:
            names.append(event.name)
            if event.name == "RunEnded":
                break
    assert names.count("BlowAccepted") == 3
    assert first.data["accepted"] == 1


def test_a_technician_answers_prompts_and_stops(lab: Client) -> None:
    run = lab.create_run(small())
    with lab.driving("test") as driver:
        driver.start(run.id)
        while (prompt := lab.rig().prompt) is None:
            assert lab.rig().phase != "idle", "the run ended without asking for anything"
        driver.answer(run.id, prompt.number)
        assert lab.stop() == run.id
        assert lab.wait_for_run(run.id).state is RunState.STOPPED
        assert lab.stop() is None
        with pytest.raises(ProblemError, match="STOP is in force"):
            driver.resume(run.id, automatic=True)
        driver.reset_stop()
        assert lab.rig().stop is None
        driver.resume(run.id, automatic=True)
        assert lab.wait_for_run(run.id).state is RunState.FINISHED
        assert driver.acknowledge_interlock(run.id, "nothing had tripped") == []


def test_who_drives_examines_the_rig_and_signs_what_was_found(lab: Client) -> None:
    with lab.driving("test") as driver:
        found = driver.examine(ExaminationRequest(trip=True))
        assert [check.advice for check in found.checks if check.state is CheckState.FAILED] == []
        with pytest.raises(ProblemError, match="the mass that hangs was not given"):
            driver.examine(ExaminationRequest(place=Place.MASS))
    assert found.verdict is Verdict.PASSED
    assert [each.id for each in lab.examinations()] == [found.id]
    assert {each.kind for each in found.instruments} >= {"tester", "thermometer", "acquisition", "force_iepe"}


def test_a_problem_is_an_exception_with_the_message_of_the_service(lab: Client) -> None:
    with pytest.raises(ProblemError, match="there is no run 7") as caught:
        lab.run(7)
    assert (caught.value.status, caught.value.title) == (404, "Not found")


def test_a_key_goes_with_every_request(catalogue: Catalogue, make_key: MakeKey) -> None:
    secret = make_key(Scope.READ)
    with catalogue.writing() as session:
        for number in range(150):
            start_run(session, kind="hammer", title=f"run {number}", article="a", setup={})
    with served(create_app(Services(catalogue))) as client:
        with Client(str(client.base_url), secret) as lab:
            assert len(list(lab.runs())) == 150
        with Client(str(client.base_url)) as stranger, pytest.raises(ProblemError, match="give a key"):
            list(stranger.runs())


def test_no_service_is_a_problem_too() -> None:
    with Client("http://127.0.0.1:9") as lab, pytest.raises(ProblemError, match=r"no service answers at http://127"):
        lab.health()


def test_the_example_ends_with_k_h_and_gamma_of_both_methods_in_the_database(tmp_path: Path) -> None:
    document = paper()
    document["steps"][0] |= {"blows": 6, "block_seconds": 1.0}  # after three, no gamma is known in one run of three
    document["steps"][1] |= {"amplitudes_pp_mm": [0.1], "frequencies": {"first": 20, "last": 180, "step": 80}}
    path = tmp_path / "sequence.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    with serving(tmp_path, "--simulated", "--speed", "200") as address:
        done = subprocess.run(
            [sys.executable, EXAMPLE, "--address", address, "--sequence", path],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "joint II, maximum likelihood on accelerances: y: k " in done.stdout
    with closing(sqlite3.connect(tmp_path / "jointlab.db")) as connection:
        inverse = connection.execute(
            "SELECT count(DISTINCT method), count(stiffness), count(damping), "
            "count(loss_factor) FILTER (WHERE method LIKE 'maximum likelihood%') "
            "FROM v_joint_stiffness WHERE element = 'k22'"
        ).fetchone()
        direct = connection.execute(
            "SELECT count(stiffness), count(damping), count(loss_factor) FROM v_dynamic_stiffness"
        ).fetchone()
    assert inverse[:3] == (2, 4, 4)
    assert inverse[3] >= 1
    assert direct == (18, 18, 18)
