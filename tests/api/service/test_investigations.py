"""Investigations over REST: begun, answered, stopped, continued, and there again after a restart of the service."""

import re
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from analysis.gap.evidence.verdict import Status
from analysis.gap.experiments.joined_measurements import check_same_bench
from analysis.gap.measurement import HammerSet, Measurement
from api.service.application import create_app
from api.service.context import Services
from jointlab.client import Client
from jointlab.diagnosis.conditions import conditions_of_run
from jointlab.diagnosis.investigation import INVESTIGATION, Asked, Data, End, Refused, Step, with_step
from jointlab.diagnosis.load import subject_of_run
from jointlab.documents.investigations import AnswerDocument
from jointlab.jobs.executors import ProcessExecutor
from jointlab.jobs.investigations import list_investigations
from jointlab.jobs.queue import JobQueue
from jointlab.supervision.manager import RunManager
from rig.sequences.sequence import sequence_from
from store.catalogue import Catalogue
from store.measurements.runs import get_run
from store.results.analyses import get_analysis
from store.results.diagnoses import list_diagnoses
from store.service.jobs import Job, finish_job, take_job
from store.states import RunState, Scope
from tests.api.service.conftest import Acting, MakeKey, served
from tests.investigations import (
    DELAY,
    HALF_FORCE,
    NOTHING_MORE,
    READ,
    READING,
    add_spent,
    add_waiting,
    import_as,
    small,
    small_further,
    struck_harder,
)
from tests.rewriting import rewrite
from tests.waiting import until

Post = Callable[..., httpx.Response]


@contextmanager
def service_on(catalogue: Catalogue, workers: int = 1) -> Iterator[httpx.Client]:
    """A service that does jobs with some processes, until it is closed."""
    with served(create_app(Services(catalogue, jobs=JobQueue(catalogue, ProcessExecutor(workers))))) as client:
        yield client


@pytest.fixture
def idle(catalogue: Catalogue) -> Iterator[httpx.Client]:
    """A service without workers: what is queued waits."""
    with service_on(catalogue, workers=0) as client:
        yield client


@pytest.fixture
def run(catalogue: Catalogue, tmp_path: Path) -> int:
    """A small measurement, as a run."""
    return import_as(catalogue, small(5, tmp_path / "first"))


@pytest.fixture
def post(idle: httpx.Client, acting: Acting) -> Post:
    return posting(idle, acting)


def posting(client: httpx.Client, acting: Acting) -> Post:
    """Act on investigations; a body of None is none."""

    def send(path: str, body: dict[str, Any] | None = None) -> httpx.Response:
        return client.post(f"/api/investigations{path}", json=body, headers=acting())

    return send


def shown(client: httpx.Client, number: int) -> dict[str, Any]:
    document: dict[str, Any] = client.get(f"/api/investigations/{number}").raise_for_status().json()
    return document


def at_rest(client: httpx.Client, number: int) -> dict[str, Any]:
    """The investigation, once it works no more."""
    until(lambda: shown(client, number)["state"] != "working", longest=0.1)
    return shown(client, number)


def test_a_gap_is_investigated_over_a_restart_until_a_reading_confirms_the_verdict(
    catalogue: Catalogue, acting: Acting, run: int
) -> None:
    with service_on(catalogue) as client:
        begun = posting(client, acting)("", {"run": run, "minutes": 60})
        assert (begun.status_code, begun.json()["state"]) == (202, "working")
        number = begun.json()["id"]
        waiting = at_rest(client, number)
    assert waiting["budget"] == {"minutes": 60.0, "experiments": 3, "certain": 0.95}
    (step,) = waiting["steps"]
    assert (waiting["state"], step["leads"]["effects"]) == ("waiting", ["channel_delay"])
    asked = step["asked"]
    assert (0 < asked["information"] <= asked["doubt"], asked["minutes"]) == (True, 10.0)
    with service_on(catalogue) as client:
        assert shown(client, number) == waiting
        ended = waiting
        while ended["state"] == "waiting":
            readings = {name: READ[name] for name in ended["steps"][-1]["asked"]["readings"]}
            given = posting(client, acting)(f"/{number}/answer", {"readings": readings})
            assert (given.status_code, given.json()["state"]) == (202, "working")
            ended = at_rest(client, number)
            assert ended["steps"][-2]["answer"] == {"run": None, "readings": readings, "refusal": None}
        assert readings == {"channel_delay.tau": DELAY}
        assert (ended["state"], ended["ended"]) == ("ended", "certain")
        assert ended["experiments"] == len(ended["steps"]) - 1 < 3
        assert ended["leads"]["probability"] > 0.95
        kept = [client.get(f"/api/diagnoses/{each['diagnosis']}").json() for each in ended["steps"]]
        assert [each["effects"] for each in kept] == [["channel_delay"]] * len(kept)
        (listed,) = client.get("/api/investigations", params={"run": run}).json()["items"]
        assert listed == {name: ended[name] for name in listed}
        assert client.get("/api/investigations", params={"run": run + 1}).json()["items"] == []


def test_a_further_run_is_diagnosed_together_with_the_first(
    catalogue: Catalogue, acting: Acting, run: int, tmp_path: Path
) -> None:
    further = import_as(catalogue, small_further(5, tmp_path / "further"))
    number = add_waiting(catalogue, run, HALF_FORCE).id
    with service_on(catalogue) as client:
        planned = sequence_from(client.get(f"/api/investigations/{number}/sequence").json(), "planned")
        assert [step.step for step in planned.steps] == ["hammer"]
        posting(client, acting)(f"/{number}/answer", {"run": further}).raise_for_status()
        found = at_rest(client, number)
    assert found["error"] is None
    assert [found["steps"][0]["answer"]["run"], found["experiments"], found["minutes"]] == [further, 1, 14.0]
    with catalogue.reading() as session:
        together = found["steps"][1]["diagnosis"]
        assert get_analysis(session, together).runs == (run, further)
        assert [each.analysis_id for each in list_diagnoses(session, run_id=further)] == [together]
        assert list_diagnoses(session, run_id=further, alone=True) == []


def test_its_sequence_is_measured_with_the_lease_as_ever_and_the_run_is_taken(
    catalogue: Catalogue, rig: RunManager, run: int
) -> None:
    number = add_waiting(catalogue, run, HALF_FORCE).id
    app = create_app(Services(catalogue, rig, jobs=JobQueue(catalogue, ProcessExecutor(0))))
    with served(app) as http, Client(str(http.base_url)) as lab:
        planned = lab.create_run(lab.investigation_sequence(number))
        start = http.post(f"/api/runs/{planned.id}/start", json={}, headers={"Idempotency-Key": "no-lease"})
        assert start.status_code == 409, start.text
        assert lab.run(planned.id).state is RunState.CREATED  # the request alone has begun nothing
        with lab.driving("investigation") as driver:
            driver.start(planned.id, automatic=True)
            measured = lab.wait_for_run(planned.id)
        assert measured.state is RunState.FINISHED, measured.reason
        assert {blow.point for blow in lab.blows(planned.id)} > {"3y"}
        (step,) = lab.answer_investigation(number, run=planned.id).steps
        assert (step.answer, step.missing) == (AnswerDocument(run=planned.id), [])
    with catalogue.reading() as session:
        conditions = conditions_of_run(session, get_run(session, planned.id))
    assert_conditions_are_of(subject_of_run(catalogue, planned.id).measurement, conditions)


def test_conditions_of_an_imported_run_are_those_of_its_data(catalogue: Catalogue, run: int) -> None:
    with catalogue.reading() as session:
        conditions = conditions_of_run(session, get_run(session, run))
    measured = subject_of_run(catalogue, run).measurement
    assert_conditions_are_of(measured, conditions)
    assert measured.points is not None
    assert conditions.points is not None
    for name in ("order", "specimen", "configuration", "amplitude", "frequency"):
        assert np.array_equal(getattr(conditions.points, name), getattr(measured.points, name)), name
    assert conditions.preset == measured.preset > 0


def assert_conditions_are_of(measured: Measurement, conditions: Measurement) -> None:
    check_same_bench(measured.drawing, conditions.drawing)
    assert [each.inputs for each in conditions.sets] == [each.inputs for each in measured.sets]
    for name in ("peak_force", "highest"):
        found, wanted = ([_of(each, name) for each in of.sets] for of in (conditions, measured))
        assert found == pytest.approx(wanted, rel=0.01), name
    assert (conditions.points is None) == (measured.points is None)


def _of(each: HammerSet, name: str) -> float:
    return float(each.frequency[-1]) if name == "highest" else each.peak_force


def test_a_run_that_lacks_something_is_taken_and_the_step_tells_what(
    catalogue: Catalogue, idle: httpx.Client, post: Post, run: int, tmp_path: Path
) -> None:
    harder = struck_harder(small_further(5, tmp_path / "further"), 1.36)
    for file in harder.glob("inverse_*.unv"):
        rewrite(file, rows=-1)
    number = add_waiting(catalogue, run, HALF_FORCE).id
    given = post(f"/{number}/answer", {"run": import_as(catalogue, harder)})
    assert (given.status_code, given.json()["state"]) == (202, "working")
    force, points = shown(idle, number)["steps"][0]["missing"]
    assert (force["what"], force["wanted"], force["measured"], force["unit"]) == ("force", 50.0, 68.0, "N")
    assert force["text"] == "a peak force of about 50 N (nearest measured: 68 N)"
    assert (points["what"], points["wanted"], points["unit"], len(points["points"])) == ("points", None, None, 1)
    assert post(f"/{number}/stop").json()["steps"][0]["missing"] == []  # the answer does not count


SNIPPET = re.search(
    r"^```python\n(.*?)^```",
    (Path(__file__).parents[3] / "docs" / "investigate.md").read_text(encoding="utf-8"),
    re.MULTILINE | re.DOTALL,
)


def test_the_loop_of_the_documentation_runs_until_nothing_is_asked_for(
    catalogue: Catalogue, rig: RunManager, make_key: MakeKey, run: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """On the simulated rig, with real requests; the diagnoses are scripted, since others test them."""
    assert SNIPPET is not None
    app = create_app(Services(catalogue, rig, jobs=JobQueue(catalogue, ProcessExecutor(0))))
    with served(app) as http, ThreadPoolExecutor(1) as thread:
        loop = SNIPPET[1]
        for of_example, here in (
            ("http://127.0.0.1:8000", str(http.base_url)),
            ("jl_...", make_key(*Scope)),
            ("investigate(12,", f"investigate({run},"),
            ("rig.start(run.id)", "rig.start(run.id, automatic=True)"),  # nobody is here to strike
        ):
            assert loop.count(of_example) == 1
            loop = loop.replace(of_example, here)
        steps = thread.submit(diagnose_by, catalogue, [READING, HALF_FORCE, None])
        exec(compile(loop, "docs/investigate.md", "exec"), {})
        steps.result()
    assert "['channel_delay']" in capsys.readouterr().out
    (found,) = catalogue.read(list_investigations)
    refused, measured, last = found.investigation.steps
    assert isinstance(refused.answer, Refused)
    assert isinstance(measured.answer, Data)
    assert (measured.missing, last.ended) == ((), "nothing would help")
    assert catalogue.read(get_run, int(measured.answer.source)).state is RunState.FINISHED


def diagnose_by(catalogue: Catalogue, requests: Sequence[Asked | None]) -> None:
    """Do as many jobs of an investigation, each with one of the requests as its result."""
    for asked in requests:
        taken = list[tuple[Job, str]]()

        def take(found: list[tuple[Job, str]] = taken) -> bool:
            with catalogue.writing() as session:
                if (one := take_job(session, ["investigate"])) is not None:
                    found.append(one)
            return bool(found)

        until(take)
        ((job, token),) = taken
        state = INVESTIGATION.validate_python(job.parameters["state"])
        ended: End | None = "nothing would help" if asked is None else None
        step = Step(len(state.steps) + 1, Status.EXPLAINED, ("channel_delay",), 0.7, asked, ended=ended)
        with catalogue.writing() as session:
            after = INVESTIGATION.dump_python(with_step(state, step), mode="json")
            finish_job(session, job.id, token, {"state": after})


def test_an_answer_that_does_not_fit_is_refused_and_the_request_stays_open(
    catalogue: Catalogue, idle: httpx.Client, post: Post, run: int, tmp_path: Path
) -> None:
    other, again = (import_as(catalogue, small(seed, tmp_path / str(seed))) for seed in (6, 5))
    said_to_measure = "strike again at half the peak force, with a peak force of about 50 N (nearest measured: 100 N)"
    number, reading = add_waiting(catalogue, run, HALF_FORCE).id, add_waiting(catalogue, run, READING).id
    for path, body, status, said in (
        (f"/{number}/answer", {"run": 77}, 404, "there is no run 77"),
        (f"/{number}/answer", {"run": run}, 422, "is among the data of investigation 1 already"),
        (f"/{number}/answer", {"run": again}, 422, said_to_measure),
        (f"/{number}/answer", {"run": other}, 422, "node_positions of the further measurement differs"),
        (
            f"/{number}/answer",
            {"readings": {"joint_mass.m": 0.1}},
            422,
            "joint_mass.m does not answer the open question",
        ),
        (f"/{number}/answer", {}, 422, "give one of run, readings and refusal"),
        (f"/{number}/answer", {"run": other, "refusal": "no"}, 422, "give one of run, readings and refusal"),
        (f"/{reading}/answer", {"run": other}, 422, "give channel_delay.tau in place of data"),
        (f"/{number}/continue", {}, 409, "is waiting; it goes on by itself, or with the answer"),
        ("/77/answer", {"refusal": "no"}, 404, "there is no investigation 77"),
        ("", {"run": 77}, 404, "there is no run 77"),
    ):
        answer = post(path, body)
        assert (answer.status_code, said in answer.json()["detail"]) == (status, True), answer.text
    for each in (number, reading):
        assert (shown(idle, each)["state"], shown(idle, each)["steps"][0]["answer"]) == ("waiting", None)
    refused = idle.get(f"/api/investigations/{reading}/sequence")
    assert (refused.status_code, "which need no sequence" in refused.json()["detail"]) == (409, True)
    assert idle.get("/api/jobs", params={"state": "queued"}).json()["items"] == []


def test_one_answer_is_taken_and_a_second_one_is_told_so(
    catalogue: Catalogue, idle: httpx.Client, post: Post, run: int
) -> None:
    number = add_waiting(catalogue, run, READING).id
    given = post(f"/{number}/answer", {"refusal": "no free mass here"})
    assert (given.status_code, given.json()["state"]) == (202, "working")
    assert given.json()["steps"][0]["answer"]["refusal"] == "no free mass here"
    again = post(f"/{number}/answer", {"readings": {"channel_delay.tau": DELAY}})
    assert (again.status_code, "has no open question" in again.json()["detail"]) == (409, True)
    assert idle.get(f"/api/investigations/{number}/sequence").status_code == 409
    assert len(idle.get("/api/jobs", params={"state": "queued"}).json()["items"]) == 1


def test_a_refusal_asks_for_what_is_known_to_be_next_and_diagnoses_nothing(
    catalogue: Catalogue, acting: Acting, run: int
) -> None:
    number = add_waiting(catalogue, run, READING, HALF_FORCE, NOTHING_MORE).id
    with service_on(catalogue) as client:
        (step,) = shown(client, number)["steps"]
        assert [each["experiment"] for each in step["otherwise"]] == ["half_force"]
        answered = partial(posting(client, acting), f"/{number}/answer", {"refusal": "not here"})
        answered().raise_for_status()
        second = at_rest(client, number)
        assert (second["state"], second["steps"][1]["asked"]["experiment"]) == ("waiting", "half_force")
        answered().raise_for_status()
        ended = at_rest(client, number)
        assert (ended["ended"], ended["experiments"], ended["minutes"]) == ("nothing would help", 0, 0.0)
        assert client.get("/api/diagnoses").json()["items"] == []


def test_one_that_is_stopped_stays_so_and_goes_on_where_it_was(
    catalogue: Catalogue, idle: httpx.Client, post: Post, run: int
) -> None:
    number = add_waiting(catalogue, run, READING).id
    for _ in range(2):  # a second time, nothing changes
        stopped = post(f"/{number}/stop")
        assert (stopped.status_code, stopped.json()["state"]) == (200, "stopped")
    assert stopped.json()["steps"][0]["answer"] is None
    assert post(f"/{number}/continue", {}).json()["state"] == "working"
    working = post(f"/{number}/stop").json()
    assert (working["state"], shown(idle, number)) == ("stopped", working)
    answered = post(f"/{number}/answer", {"readings": {"channel_delay.tau": DELAY}})  # it goes on with that
    assert answered.json()["state"] == "working"
    cut = post(f"/{number}/stop").json()
    assert (cut["state"], cut["steps"][0]["answer"]) == ("stopped", None)  # what was not diagnosed does not count
    assert post(f"/{number}/continue", {}).json()["steps"][0]["answer"]["readings"] == {"channel_delay.tau": DELAY}
    jobs = idle.get("/api/jobs", params={"kind": "investigate"}).json()["items"]
    assert {each["parameters"].get("investigation") for each in jobs} == {None, number}


def test_a_new_one_that_is_stopped_and_one_whose_budget_is_spent_go_on(
    catalogue: Catalogue, post: Post, run: int
) -> None:
    spent = add_spent(catalogue, run).id
    number = post("", {"run": run, "experiments": 1}).json()["id"]
    twice = post("", {"run": run, "experiments": 1})
    assert (twice.status_code, "does that already" in twice.json()["detail"]) == (409, True)
    stopped = post(f"/{number}/stop").json()
    assert (stopped["state"], stopped["steps"], stopped["leads"]) == ("stopped", [], None)
    more = post(f"/{number}/continue", {"experiments": 2}).json()
    assert (more["state"], more["budget"]["experiments"], more["budget"]["minutes"]) == ("working", 2, 240.0)
    assert post(f"/{spent}/answer", {"refusal": "no"}).status_code == 409
    assert post(f"/{spent}/stop").json()["state"] == "ended"
    same = post(f"/{spent}/continue", {})
    assert (same.status_code, "with a larger one" in same.json()["detail"]) == (409, True)
    larger = post(f"/{spent}/continue", {"experiments": 2}).json()
    assert (larger["state"], larger["steps"]) == ("working", [])  # the step without a request is made again


def test_a_diagnosis_that_fails_says_why_and_the_request_is_open_again(
    catalogue: Catalogue, acting: Acting, run: int, tmp_path: Path
) -> None:
    """The preset of the tester is another one, which only the data tell."""
    further = struck_harder(small(5, tmp_path / "other preset"), 0.5)
    setup = further / "setup.json"
    text = setup.read_text(encoding="utf-8")
    assert '"preset_mm"' in text
    setup.write_text(re.sub(r'"preset_mm": [0-9.]+', '"preset_mm": 0.123', text), encoding="utf-8")
    number = add_waiting(catalogue, run, HALF_FORCE).id
    with service_on(catalogue) as client:
        post = posting(client, acting)
        post(f"/{number}/answer", {"run": import_as(catalogue, further)}).raise_for_status()
        failed = at_rest(client, number)
        assert (failed["state"], failed["steps"][0]["answer"]) == ("failed", None)
        assert "diagnose them separately" in failed["error"]
        assert client.get(f"/api/investigations/{number}/sequence").status_code == 200
        assert post(f"/{number}/stop").json()["state"] == "stopped"
        post(f"/{number}/continue", {}).raise_for_status()
        assert at_rest(client, number)["state"] == "waiting"
