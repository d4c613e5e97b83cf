"""A store of many years, 10,000 runs and 1,000,000 sine points, on both databases: what lists and filters take.

python -m tests.bench bench_scale             # the figures
PLANS=1 python -m tests.bench bench_scale     # and how each database finds the rows
"""

import os
import re
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from sqlalchemy import event, insert, text
from sqlalchemy.orm import Session

from store.analyses import latest_analysis
from store.blows import list_blows
from store.catalogue import Catalogue
from store.dynamic_stiffness import list_dynamic_stiffness
from store.instruments import list_known_instruments
from store.joint_matrices import list_joint_matrices
from store.models.measurements import RunRow
from store.models.results import AnalysisRow, AnalysisRunRow
from store.result_queries import find_comparisons, find_elements, find_sine_points
from store.runs import count_runs, list_runs
from store.sine_records import list_sine_records
from store.specimens import list_specimens
from store.states import AnalysisKind, RunState
from tests.postgresql_server import NotInstalledError, running_server

RUNS, POINTS_OF_A_RUN, ARTICLES = 10_000, 200, 100
REPEATS = 7
LIMIT_MS = 200.0
REPORT_ROWS = 5_000  # more is a report over everything, which takes as long as its rows
COOKBOOK = Path(__file__).resolve().parents[2] / "docs" / "queries.md"
STATES = [RunState.FINISHED] * 17 + [RunState.STOPPED] * 2 + [RunState.FAILED]

# The same text on both databases: run 2 n is a sweep, run 2 n - 1 a hammer run of the same article.
SPECIMENS = """
INSERT INTO specimens (article, name, created_at, software_version)
SELECT DISTINCT article, joint.name, min(created_at), 'bench'
FROM runs CROSS JOIN (SELECT 'I' AS name UNION SELECT 'II') AS joint GROUP BY article, joint.name
"""
SINE_RECORDS = f"""
INSERT INTO sine_records (run_id, specimen_id, order_number, configuration, commanded_pp_mm, reached_pp_mm, frequency,
    elapsed, recorded_at, temperature_c, waveform_record, created_at, software_version)
WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i < {POINTS_OF_A_RUN - 1})
SELECT runs.id, specimens.id, i + 1, CASE i / 2 % 3 WHEN 0 THEN 'compression' WHEN 1 THEN 'shear' ELSE 'angled' END,
    CASE i / 6 % 3 WHEN 0 THEN 0.1 WHEN 1 THEN 0.05 ELSE 0.01 END, 0.1, 5.0 * (1 + i / 18), 1.5 * i, runs.started_at,
    23.0, i + 1, runs.created_at, 'bench'
FROM runs CROSS JOIN n
JOIN specimens ON specimens.article = runs.article AND specimens.name = CASE i % 2 WHEN 0 THEN 'I' ELSE 'II' END
WHERE runs.kind = 'sweep' ORDER BY runs.id, i
"""
SINE_POINTS = """
INSERT INTO dynamic_stiffness (analysis_id, specimen_id, sine_record_id, order_number, elapsed, configuration,
    amplitude_pp_mm, frequency, stiffness, stiffness_se, damping, damping_se, loss_factor, loss_factor_se, magnitude,
    magnitude_se, loss_angle_deg, loss_angle_se_deg, thd_percent, thd_displacement_percent, temperature_c, flags,
    degrees_of_freedom, stiffness_damping_covariance, reached_pp_mm, reached_pp_se_mm, thd_se_percent,
    thd_displacement_se_percent, loop_energy, loop_energy_se, loop_energy_excess, loop_energy_excess_se, shared_errors,
    created_at, software_version)
SELECT analyses.id, specimen_id, record.id, order_number, elapsed, configuration, commanded_pp_mm, frequency,
    7e5 + 1000 * frequency + record.id % 997, 700.0, 7e4, 600.0, 0.1, 0.001, 7.1e5, 700.0, 5.7, 0.05,
    CASE WHEN record.id % 997 = 0 THEN 6.0 ELSE 0.4 + 0.001 * (record.id % 101) END, 0.1, 23.0,
    CAST(CASE WHEN record.id % 4999 = 7 THEN '["first harmonic insufficient"]' ELSE '[]' END AS {json}),
    23.0, 1e4, 1.0001 * commanded_pp_mm, 1e-6, 0.01, 0.01, 1e-3, 1e-6, 1e-6, 1e-6,
    CAST('{{"frame_compliance": [411.25, 87.5], "load_cell_gain": [702.5, 70.25]}}' AS {json}),
    record.created_at, 'bench'
FROM sine_records AS record JOIN analysis_runs ON analysis_runs.run_id = record.run_id
JOIN analyses ON analyses.id = analysis_runs.analysis_id AND analyses.kind = 'dynamic_stiffness'
ORDER BY record.id
"""
POINTS = """
INSERT INTO points (run_id, set_number, node, direction, created_at, software_version)
WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 11)
SELECT runs.id, 1, i, 'y', runs.created_at, 'bench' FROM runs CROSS JOIN n WHERE kind = 'hammer' ORDER BY runs.id, i
"""
BLOWS = """
INSERT INTO blows (point_id, number, accepted, reason, peak_force, temperature_c, struck_at, waveform_record,
    created_at, software_version)
WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 4)
SELECT points.id, i, (points.id + i) % 40 <> 0, CASE (points.id + i) % 40 WHEN 0 THEN 'double hit' END,
    100.0 + i, 23.0, points.created_at, 4 * points.node + i - 4, points.created_at, 'bench'
FROM points CROSS JOIN n ORDER BY points.id, i
"""
MODE_SETS = """
INSERT INTO mode_sets (analysis_id, dofs, created_at, software_version)
SELECT id, CAST('["1y"]' AS {json}), created_at, 'bench' FROM analyses WHERE kind = 'modes'
"""
MODES = """
INSERT INTO modes (mode_set_id, number, frequency, loss_factor, shape, created_at, software_version)
WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 6)
SELECT mode_sets.id, i, 80.0 * i, 0.05, CAST('shape' AS {binary}), created_at, 'bench' FROM mode_sets CROSS JOIN n
"""
JOINT_MATRICES = """
INSERT INTO joint_matrices (analysis_id, specimen_id, joint, node, created_at, software_version)
SELECT analyses.id, specimens.id, specimens.name, 2, analyses.created_at, 'bench'
FROM analyses JOIN analysis_runs ON analysis_runs.analysis_id = analyses.id JOIN runs ON runs.id = run_id
JOIN specimens ON specimens.article = runs.article WHERE analyses.kind = 'joint_matrices' ORDER BY analyses.id
"""
JOINT_ELEMENTS = """
INSERT INTO joint_elements (joint_matrix_id, matrix_row, matrix_column, stiffness, damping, loss_factor, observable,
    created_at, software_version)
WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i < 8)
SELECT joint_matrices.id, 1 + i / 3, 1 + i % 3, 2.6e6, 2.6e5, 0.1, i % 3 = i / 3, created_at, 'bench'
FROM joint_matrices CROSS JOIN n ORDER BY joint_matrices.id, i
"""
COMPARISONS = """
INSERT INTO comparisons (analysis_id, article, joint, element, direct_low, direct_high, verdict, created_at,
    software_version)
SELECT analysis_id, specimens.article, joint, 'k22', 2.5e6, 2.7e6, 'agree', joint_matrices.created_at, 'bench'
FROM joint_matrices JOIN specimens ON specimens.id = specimen_id
"""


def main() -> None:
    """Fill both databases and print what each request takes, slow ones marked."""
    with tempfile.TemporaryDirectory() as folder:
        with Catalogue.open(f"sqlite:///{Path(folder) / 'lab.db'}") as catalogue:
            measure("SQLite", catalogue)
        try:
            with running_server() as server:
                server.execute("CREATE DATABASE lab")
                with Catalogue.open(server.url("lab"), Path(folder) / "waveforms") as catalogue:
                    measure("PostgreSQL", catalogue)
        except NotInstalledError as error:
            print(error)


def measure(name: str, catalogue: Catalogue) -> None:
    """One database: fill it, then ask."""
    began = time.perf_counter()
    fill(catalogue)
    print(f"-- {name}, filled in {time.perf_counter() - began:.0f} s")
    for what, ask in {**functions(), **cookbook()}.items():
        took, rows, plans = timed(catalogue, ask)
        kind = "report" if rows > REPORT_ROWS else "SLOW" if statistics.median(took) > LIMIT_MS else ""
        print(
            f"{what[:72]:<72} median {statistics.median(took):7.1f} ms, most {max(took):7.1f} ms, {rows:6} rows {kind}",
            flush=True,
        )
        if os.environ.get("PLANS"):
            print(*plans, sep="\n", flush=True)


def fill(catalogue: Catalogue) -> None:
    """10,000 runs with what belongs to them, 1,000,000 sine points among that."""
    with catalogue.writing() as session:
        session.execute(insert(RunRow), [run_row(number) for number in range(1, RUNS + 1)])
        add_analyses(session)
        postgresql = session.get_bind().dialect.name == "postgresql"
        types = {"binary": "BYTEA", "json": "JSON"} if postgresql else {"binary": "BLOB", "json": "TEXT"}
        for statement in (
            SPECIMENS, SINE_RECORDS, SINE_POINTS, POINTS, BLOWS, MODE_SETS, MODES,
            JOINT_MATRICES, JOINT_ELEMENTS, COMPARISONS,
        ):  # fmt: skip
            session.execute(text(statement.format(**types)))
    if catalogue.address.startswith("postgresql"):
        with catalogue.writing() as session:
            session.execute(text("ANALYZE"))  # the server does that by itself after some minutes


def run_row(number: int) -> dict[str, Any]:
    """A hammer run where the number is odd, else a sweep; four a day."""
    started = datetime(2020, 1, 1, tzinfo=UTC) + timedelta(hours=6 * number)
    article = (number - 1) // 2 % ARTICLES
    state = STATES[number % len(STATES)] if number < RUNS else RunState.RUNNING
    return {
        "kind": "sweep" if number % 2 == 0 else "hammer", "state": state, "title": f"run {number}",
        "article": f"beam {article}", "started_at": started, "finished_at": started + timedelta(hours=1),
        "setup": {"joints": [{"name": joint, "note": "x" * 500} for joint in ("I", "II")]}, "sequence": {},
        "configuration_hash": f"{number:064}", "waveform_file": f"{number}.waveforms",
        "reason": None if state in (RunState.FINISHED, RunState.RUNNING) else "stopped by the operator",
    }  # fmt: skip


def add_analyses(session: Session) -> None:
    """Each kind that belongs to a run, the inverse ones twice: a new computation beside the old one."""
    kinds = (AnalysisKind.FREQUENCY_RESPONSES, AnalysisKind.MODES, AnalysisKind.JOINT_MATRICES) * 2
    wanted = [
        (kind, run) for run in range(1, RUNS + 1) for kind in (kinds if run % 2 else (AnalysisKind.DYNAMIC_STIFFNESS,))
    ]
    rows = [{"kind": kind, "method": "bench", "settings": {}, "configuration_hash": "0"} for kind, _ in wanted]
    session.execute(insert(AnalysisRow), rows)
    used = [{"analysis_id": number, "run_id": run} for number, (_, run) in enumerate(wanted, start=1)]
    session.execute(insert(AnalysisRunRow), used)


Ask = Callable[[Session], Sequence[Any]]


def functions() -> dict[str, Ask]:
    """What the service and the commands ask for."""
    sweep = RUNS // 2

    def newest(session: Session, kind: AnalysisKind, run: int) -> int:
        return latest_analysis(session, run, kind).id

    return {
        "list_runs: the newest 100": list_runs,
        "list_runs: 100 far back": lambda session: list_runs(session, before=200),
        "list_runs: failed": lambda session: list_runs(session, state=RunState.FAILED),
        "list_runs: running": lambda session: list_runs(session, state=RunState.RUNNING),
        "list_runs: sweeps": lambda session: list_runs(session, kind="sweep"),
        "list_runs: one article": lambda session: list_runs(session, article="beam 3"),
        "list_runs: of no article": lambda session: list_runs(session, article="none"),
        "count_runs": lambda session: [count_runs(session)],
        "list_sine_records of a run": lambda session: list_sine_records(session, sweep),
        "list_dynamic_stiffness of a run": lambda session: list_dynamic_stiffness(
            session, newest(session, AnalysisKind.DYNAMIC_STIFFNESS, sweep)
        ),
        "list_joint_matrices of a run": lambda session: list_joint_matrices(
            session, newest(session, AnalysisKind.JOINT_MATRICES, sweep - 1)
        ),
        "list_blows of a run": lambda session: list_blows(session, sweep - 1),
        "list_runs: 100 behind run 200": lambda session: list_runs(session, before=200),
        "list_runs: sweeps behind run 200": lambda session: list_runs(session, kind="sweep", before=200),
        "find_sine_points: an article": lambda session: find_sine_points(session, article="beam 3"),
        "find_sine_points: 1000 of a specimen": lambda session: find_sine_points(
            session, article="beam 3", specimen="I", limit=1000
        ),
        "find_sine_points: at an amplitude that is not there": lambda session: find_sine_points(
            session, article="beam 3", amplitude_pp_mm=0.07
        ),
        "find_sine_points: rare frequencies": lambda session: find_sine_points(
            session, article="beam 3", configuration="shear", lowest_frequency=55.0, highest_frequency=60.0
        ),
        "find_elements: an article": lambda session: find_elements(session, article="beam 3"),
        "find_elements: 1000 of a joint by a method": lambda session: find_elements(
            session, article="beam 3", joint="II", method="bench", limit=1000
        ),
        "find_elements: by a method that is not there": lambda session: find_elements(
            session, article="beam 3", method="none"
        ),
        "find_comparisons: an article": lambda session: find_comparisons(session, article="beam 3"),
        "find_comparisons: a verdict that is not there": lambda session: find_comparisons(
            session, article="beam 3", verdict="differ"
        ),
        "list_specimens": list_specimens,
        "list_known_instruments": list_known_instruments,
    }


def cookbook() -> dict[str, Ask]:
    """Every query of `docs/queries.md`, by the question before it."""
    page = COOKBOOK.read_text(encoding="utf-8")
    found = re.findall(r"([^\n]+)\n\n```sql\n(.*?);\n```", page, flags=re.DOTALL)
    return {question: asking(query) for question, query in found}


def asking(query: str) -> Ask:
    """Fetches all rows, as a client does."""
    return lambda session: session.execute(text(query)).all()


def timed(catalogue: Catalogue, ask: Ask) -> tuple[list[float], int, list[str]]:
    """Milliseconds of each repeat, rows found, and the plans of the statements."""
    took, rows = [], 0
    for _ in range(REPEATS):
        with catalogue.reading() as session:
            session.connection()
            began = time.perf_counter()
            rows = len(ask(session))
            took.append(1e3 * (time.perf_counter() - began))
    return took, rows, plans_of(catalogue, ask) if os.environ.get("PLANS") else []


def plans_of(catalogue: Catalogue, ask: Ask) -> list[str]:
    """How the database finds the rows of every statement that is sent."""
    sent: list[tuple[str, Any]] = []
    with catalogue.reading() as session:
        connection = session.connection()

        def note(_c: Any, _cursor: Any, statement: str, parameters: Any, *_rest: Any) -> None:
            sent.append((statement, parameters))

        event.listen(connection, "before_cursor_execute", note)
        ask(session)
        event.remove(connection, "before_cursor_execute", note)
        explain = "EXPLAIN ANALYZE" if connection.dialect.name == "postgresql" else "EXPLAIN QUERY PLAN"
        lines = []
        for statement, parameters in dict.fromkeys((statement, repr(each)) for statement, each in sent):
            given = next(each for other, each in sent if other == statement and repr(each) == parameters)
            rows = connection.exec_driver_sql(f"{explain} {statement}", given)
            lines += [f"      {row[-1]}" for row in rows]
    return lines
