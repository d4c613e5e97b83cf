"""A store that grows: what inserts, lists, filters and answers of the service take with more and more runs.

python -m tests.bench bench_scale                            # the figures, on both databases
SIZES=1000,10000 POINTS=200 python -m tests.bench bench_scale    # at these numbers of runs, and sine points of a sweep
PLANS=1 python -m tests.bench bench_scale                    # and how each database finds the rows at the last of them

Each figure is processor time, of this process and of the database server, and the least of some repeats: it is nearly
the same on a machine with other work. Waiting for a disk is not in it. What a list finds stays the same when the store
grows (`large_store`), so that a time that grows is a search that does.
"""

import itertools
import math
import os
import re
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import httpx
from sqlalchemy import text
from sqlalchemy.orm import Session

from api.service.application import create_app
from api.service.context import Services
from store.catalogue import Catalogue
from store.dof import StoredDof
from store.measurements.blows import add_blow, add_point, list_blows
from store.measurements.instruments import list_known_instruments
from store.measurements.runs import count_runs, latest_of_rig, list_provisional_runs, list_runs
from store.measurements.sine_records import SineRecord, add_sine_record, list_sine_records
from store.measurements.specimens import list_specimens
from store.results.analyses import add_analysis, latest_analysis
from store.results.dynamic_stiffness import add_dynamic_stiffness, list_dynamic_stiffness
from store.results.joint_matrices import list_joint_matrices
from store.results.result_queries import find_comparisons, find_elements, find_sine_points
from store.results.specimen_history import NominalPoint, nominal_points, specimen_history
from store.service.alarms import list_alarms
from store.service.audit import list_audit_entries
from store.service.jobs import count_jobs, count_open_jobs, find_open_job, list_jobs
from store.states import AnalysisKind, JobState, RunState
from tests.api.service.conftest import served
from tests.bench.large_store import POINTS_OF_A_RUN, article_of, fill, run_row, sizes_of
from tests.postgresql_server import NotInstalledError, Server, running_server
from tests.store.plans import plans_of

SIZES = [int(size) for size in os.environ.get("SIZES", "1000,4000,16000").split(",")]
REPEATS, PATIENCE = 5, 0.3
"""Repeats of a question, and seconds after which it is not repeated any more."""
LIMIT_MS = 200.0
GROWS = 3.0  # times from the first size to the last, of a time of more than `NOTICED` ms
NOTICED = 5.0
REPORT_ROWS = 5_000  # more is a report over everything, which takes as long as its rows
COOKBOOK = Path(__file__).resolve().parents[2] / "docs" / "queries.md"

Ask = Callable[[Session], Sequence[Any]]
Took = dict[str, tuple[float, int]]
"""Milliseconds of each question, and rows found."""
Clock = Callable[[], float]
"""Seconds of processor time so far."""


def main() -> None:
    """Let both databases grow, and print what each request takes, slow and growing ones marked."""
    with tempfile.TemporaryDirectory() as folder:
        with Catalogue.open(f"sqlite:///{Path(folder) / 'lab.db'}") as catalogue:
            measure("SQLite", catalogue, time.process_time)
        try:
            with running_server() as server:
                server.execute("CREATE DATABASE lab")
                with Catalogue.open(server.url("lab"), Path(folder) / "waveforms") as catalogue:
                    measure("PostgreSQL", catalogue, lambda: time.process_time() + processor_time(server))
        except NotInstalledError as error:
            print(error)


def processor_time(server: Server) -> float:
    """Seconds that the processes of a database server have taken so far."""
    first = (server.folder / "data" / "postmaster.pid").read_text().split()[0]
    processes = Path(f"/proc/{first}/task/{first}/children").read_text().split()
    return sum(int(Path(f"/proc/{process}/schedstat").read_text().split()[0]) for process in processes) / 1e9


def measure(name: str, catalogue: Catalogue, clock: Clock) -> None:
    """One database: let it grow, and ask at each size."""
    found, stored = list[Took](), 0
    for runs in SIZES:
        began = clock()
        fill(catalogue, stored, runs)
        stored = runs
        print(f"-- {name}, {runs} runs, filled in {clock() - began:.0f} s", flush=True)
        questions = {**functions(runs), **cookbook()}
        took = {what: timed(partial(asked, catalogue, ask), clock) for what, ask in questions.items()}
        found.append(took | answers(catalogue, clock) | inserts(catalogue, runs, clock))
        print_growth(found, SIZES[: len(found)])
    for table, (rows, size) in sizes_of(catalogue).items():
        print(f"{table:<32} {rows:9} rows, {size / rows:7.0f} bytes each with indices, {size / 1e6:7.1f} MB")
    for what, ask in ({**functions(stored), **cookbook()} if os.environ.get("PLANS") else {}).items():
        print(what, *plans_of(catalogue, ask), sep="\n      ", flush=True)


def print_growth(found: list[Took], sizes: list[int]) -> None:
    """A line for each question, with its time at each size so far."""
    ratio = sizes[-1] / sizes[0]
    for what, (last, rows) in found[-1].items():
        first = found[0][what][0]
        marks = ["report"] if rows > REPORT_ROWS else ["SLOW"] if last > LIMIT_MS else []
        if last > NOTICED and last > GROWS * first:
            marks.append(f"grows as the power {math.log(last / first) / math.log(ratio):.1f} of runs")
        times = "".join(f"{took[what][0]:9.1f}" for took in found)
        print(f"{what[:68]:<68}{times} ms, {rows:6} rows {', '.join(marks)}", flush=True)


def functions(runs: int) -> dict[str, Ask]:
    """What the service and the commands ask a store of this many runs for."""
    sweep, article, rig = runs // 2, article_of(runs // 2), str(run_row(runs // 2)["rig"])
    sine = NominalPoint("shear", 0.1, 10.0)
    days = {number: run_row(number)["started_at"] for number in (1, 200, runs // 2, runs // 2 + 50, runs)}

    def newest(session: Session, kind: AnalysisKind, run: int) -> int:
        return latest_analysis(session, run, kind).id

    return {
        "list_runs: the newest 100": list_runs,
        "list_runs: 100 behind run 200": lambda session: list_runs(session, before=200),
        "list_runs: failed": lambda session: list_runs(session, state=RunState.FAILED),
        "list_runs: running": lambda session: list_runs(session, state=RunState.RUNNING),
        "list_runs: sweeps behind run 200": lambda session: list_runs(session, kind="sweep", before=200),
        "list_runs: one article": lambda session: list_runs(session, article=article),
        "list_runs: of no article": lambda session: list_runs(session, article="none"),
        "list_runs: since a day in the middle": lambda session: list_runs(session, since=days[runs // 2]),
        "list_runs: since a day to come": lambda session: list_runs(session, since=days[runs].replace(year=2099)),
        "list_runs: until the first day": lambda session: list_runs(session, until=days[200]),
        "list_runs: some hours in the middle": lambda session: list_runs(
            session, since=days[runs // 2], until=days[runs // 2 + 50]
        ),
        "list_runs: failed on the first day": lambda session: list_runs(
            session, state=RunState.FAILED, since=days[1], until=days[200]
        ),
        "list_runs: an article before it was there": lambda session: list_runs(
            session, article=article, until=days[1]
        ),
        "count_runs": lambda session: [count_runs(session)],
        "list_provisional_runs": lambda session: list_provisional_runs(session, rig),
        "latest_of_rig": lambda session: [latest_of_rig(session, rig)],
        "latest_of_rig: of a rig without runs": lambda session: [latest_of_rig(session, "new")],
        "list_jobs: failed": lambda session: list_jobs(session, state=JobState.FAILED),
        "list_jobs: of a kind that is not there": lambda session: list_jobs(session, kind="none"),
        "find_open_job": lambda session: [find_open_job(session, "identification", {})],
        "count_open_jobs, count_jobs": lambda session: [count_open_jobs(session, "1"), count_jobs(session)],
        "list_alarms: standing": lambda session: list_alarms(session, standing=True),
        "list_alarms: standing of a rig": lambda session: list_alarms(session, rig=rig, standing=True),
        "list_alarms: of a rig": lambda session: list_alarms(session, rig=rig),
        "list_audit_entries: of an action": lambda session: list_audit_entries(session, action="start run"),
        "list_audit_entries: of no action": lambda session: list_audit_entries(session, action="none"),
        "list_sine_records of a run": lambda session: list_sine_records(session, sweep),
        "list_dynamic_stiffness of a run": lambda session: list_dynamic_stiffness(
            session, newest(session, AnalysisKind.DYNAMIC_STIFFNESS, sweep)
        ),
        "list_joint_matrices of a run": lambda session: list_joint_matrices(
            session, newest(session, AnalysisKind.JOINT_MATRICES, sweep - 1)
        ),
        "list_blows of a run": lambda session: list_blows(session, sweep - 1),
        "find_sine_points: an article": lambda session: find_sine_points(session, article=article),
        "find_sine_points: 1000 of a specimen": lambda session: find_sine_points(
            session, article=article, specimen="I", limit=1000
        ),
        "find_sine_points: at an amplitude that is not there": lambda session: find_sine_points(
            session, article=article, amplitude_pp_mm=0.07
        ),
        "find_elements: an article": lambda session: find_elements(session, article=article),
        "find_elements: by a method that is not there": lambda session: find_elements(
            session, article=article, method="none"
        ),
        "find_comparisons: a verdict that is not there": lambda session: find_comparisons(
            session, article=article, verdict="differ"
        ),
        "nominal_points": lambda session: nominal_points(session, article, "I"),
        "specimen_history": lambda session: specimen_history(session, article, "I", sine),
        "list_specimens": list_specimens,
        "list_known_instruments": list_known_instruments,
    }  # fmt: skip


def cookbook() -> dict[str, Ask]:
    """Every query of `docs/queries.md`, by the question before it."""
    page = COOKBOOK.read_text(encoding="utf-8")
    found = re.findall(r"([^\n]+)\n\n```sql\n(.*?);\n```", page, flags=re.DOTALL)
    return {question: asking(query) for question, query in found}


def asking(query: str) -> Ask:
    """Fetches all rows, as a client does."""
    return lambda session: session.execute(text(query)).all()


def asked(catalogue: Catalogue, ask: Ask) -> int:
    """Put one question; rows found."""
    with catalogue.reading(long=True) as session:
        return len(ask(session))


def answers(catalogue: Catalogue, clock: Clock) -> Took:
    """What service and client take for its lists over HTTP."""
    paths = (
        "/api/runs", "/api/runs?limit=1000", "/api/runs?article=beam%203", "/api/runs?until=2020-01-01",
        "/api/runs?state=failed&since=2020-01-01&until=2020-01-01", "/api/dynamic-stiffness?article=beam%203",
        "/api/joint-elements?article=beam%203", "/api/comparisons?article=beam%203", "/api/jobs?state=queued",
        "/api/alarms?standing=true", "/api/audit", "/api/specimens", "/api/metrics", "/api/health",
    )  # fmt: skip

    def answered(client: httpx.Client, path: str) -> int:
        answer = client.get(path).raise_for_status()
        return len(answer.json()["items"]) if '"items"' in answer.text else 1

    with served(create_app(Services(catalogue))) as client:
        return {f"GET {path}": timed(partial(answered, client, path), clock) for path in paths}


def inserts(catalogue: Catalogue, run: int, clock: Clock) -> Took:
    """What it takes to store a blow, a sine record and the results of a sweep, a commit each."""
    with catalogue.writing() as session:
        point = add_point(session, run, StoredDof(1, "y"))
        points = list_dynamic_stiffness(session, latest_analysis(session, run, AnalysisKind.DYNAMIC_STIFFNESS).id)
    numbers = itertools.count(POINTS_OF_A_RUN + 1)

    def blow(session: Session) -> None:
        add_blow(session, point, next(numbers), accepted=True)

    def sine(session: Session) -> None:
        add_sine_record(session, run, SineRecord(next(numbers), "I", "shear", 0.1, 0.1, 5.0, 1.0, None, 23.0, None))

    def stiffness(session: Session) -> None:
        kind = AnalysisKind.DYNAMIC_STIFFNESS
        add_dynamic_stiffness(session, add_analysis(session, kind=kind, method="x", settings={}, runs=[run]), points)

    def stored(work: Callable[[Session], None], rows: int) -> int:
        with catalogue.writing() as session:
            work(session)
        return rows

    return {
        "insert: a blow": timed(partial(stored, blow, 1), clock),
        "insert: a sine record": timed(partial(stored, sine, 1), clock),
        "insert: the points of a sweep's analysis": timed(partial(stored, stiffness, len(points)), clock),
    }


def timed(ask: Callable[[], int], clock: Clock) -> tuple[float, int]:
    """The least of the times of a question, ms, and the rows that it found."""
    took, rows = list[float](), 0
    while len(took) < REPEATS and sum(took) < PATIENCE:
        began = clock()
        rows = ask()
        took.append(clock() - began)
    return 1e3 * min(took), rows


if __name__ == "__main__":
    main()
