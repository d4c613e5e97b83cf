"""Rows of many years in a catalogue: hammer runs and sweeps with what belongs to them, in fixed ratios.

Of a thousand runs half are sweeps of `POINTS_OF_A_RUN` sine points; ten articles share them, and 200 rigs take turns.
"""

import os
from datetime import UTC, datetime, timedelta
from typing import Any

from sqlalchemy import func, insert, select, text
from sqlalchemy.orm import Session

from store.catalogue import Catalogue
from store.database.connection import allow_long_work
from store.models.measurements import RunEventRow, RunRow
from store.models.results import AnalysisRow, AnalysisRunRow
from store.models.service import AlarmRow, AuditEntryRow, JobRow
from store.states import AlarmKind, AnalysisKind, JobState, RunState

POINTS_OF_A_RUN, RIGS = int(os.environ.get("POINTS", "50")), 200
GROUP, ARTICLES = 1_000, 10
"""Runs that are stored at a time, and articles among them."""
STATES = [RunState.FINISHED] * 17 + [RunState.STOPPED] * 2 + [RunState.FAILED]

# The same text on both databases: run 2 n is a sweep, run 2 n - 1 a hammer run of the same article.
SPECIMENS = """
INSERT INTO specimens (article, name, created_at, software_version)
SELECT article, joint.name, min(created_at), 'bench'
FROM runs CROSS JOIN (SELECT 'I' AS name UNION SELECT 'II') AS joint
WHERE runs.id BETWEEN :first AND :last GROUP BY article, joint.name
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
WHERE runs.kind = 'sweep' AND runs.id BETWEEN :first AND :last ORDER BY runs.id, i
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
WHERE record.run_id BETWEEN :first AND :last ORDER BY record.id
"""
POINTS = """
INSERT INTO points (run_id, set_number, node, direction, created_at, software_version)
WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 11)
SELECT runs.id, 1, i, 'y', runs.created_at, 'bench' FROM runs CROSS JOIN n
WHERE kind = 'hammer' AND runs.id BETWEEN :first AND :last
ORDER BY runs.id, i
"""
BLOWS = """
INSERT INTO blows (point_id, number, accepted, reason, peak_force, temperature_c, struck_at, waveform_record,
    created_at, software_version)
WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 4)
SELECT points.id, i, (points.id + i) % 40 <> 0, CASE (points.id + i) % 40 WHEN 0 THEN 'double hit' END,
    100.0 + i, 23.0, points.created_at, 4 * points.node + i - 4, points.created_at, 'bench'
FROM points CROSS JOIN n WHERE points.run_id BETWEEN :first AND :last ORDER BY points.id, i
"""
MODE_SETS = """
INSERT INTO mode_sets (analysis_id, dofs, created_at, software_version)
SELECT id, CAST('["1y"]' AS {json}), created_at, 'bench'
FROM analyses JOIN analysis_runs ON analysis_id = id WHERE kind = 'modes' AND run_id BETWEEN :first AND :last
"""
MODES = """
INSERT INTO modes (mode_set_id, number, frequency, loss_factor, shape, created_at, software_version)
WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 6)
SELECT mode_sets.id, i, 80.0 * i, 0.05, CAST('shape' AS {binary}), created_at, 'bench'
FROM mode_sets JOIN analysis_runs ON analysis_runs.analysis_id = mode_sets.analysis_id CROSS JOIN n
WHERE run_id BETWEEN :first AND :last
"""
JOINT_MATRICES = """
INSERT INTO joint_matrices (analysis_id, specimen_id, joint, node, created_at, software_version)
SELECT analyses.id, specimens.id, specimens.name, 2, analyses.created_at, 'bench'
FROM analyses JOIN analysis_runs ON analysis_runs.analysis_id = analyses.id JOIN runs ON runs.id = run_id
JOIN specimens ON specimens.article = runs.article WHERE analyses.kind = 'joint_matrices'
AND runs.id BETWEEN :first AND :last ORDER BY analyses.id
"""
JOINT_ELEMENTS = """
INSERT INTO joint_elements (joint_matrix_id, matrix_row, matrix_column, stiffness, damping, loss_factor, observable,
    created_at, software_version)
WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i < 8)
SELECT joint_matrices.id, 1 + i / 3, 1 + i % 3, 2.6e6, 2.6e5, 0.1, i % 3 = i / 3, created_at, 'bench'
FROM joint_matrices JOIN analysis_runs ON analysis_runs.analysis_id = joint_matrices.analysis_id CROSS JOIN n
WHERE run_id BETWEEN :first AND :last ORDER BY joint_matrices.id, i
"""
COMPARISONS = """
INSERT INTO comparisons (analysis_id, article, joint, element, direct_low, direct_high, verdict, created_at,
    software_version)
SELECT joint_matrices.analysis_id, specimens.article, joint, 'k22', 2.5e6, 2.7e6, 'agree',
    joint_matrices.created_at, 'bench'
FROM joint_matrices JOIN specimens ON specimens.id = specimen_id
JOIN analysis_runs ON analysis_runs.analysis_id = joint_matrices.analysis_id WHERE run_id BETWEEN :first AND :last
"""


STATEMENTS = (
    SPECIMENS, SINE_RECORDS, SINE_POINTS, POINTS, BLOWS, MODE_SETS, MODES, JOINT_MATRICES, JOINT_ELEMENTS, COMPARISONS,
)  # fmt: skip


def fill(catalogue: Catalogue, stored: int, runs: int) -> None:
    """Let a catalogue of `stored` runs have `runs`, with what belongs to them; both are multiples of `GROUP`."""
    for last in range(stored + GROUP, runs + 1, GROUP):
        with catalogue.writing() as session:
            allow_long_work(session.connection())
            _fill(session, range(last - GROUP + 1, last + 1))
    if catalogue.address.startswith("postgresql"):
        with catalogue.writing() as session:
            allow_long_work(session.connection())
            session.execute(text("ANALYZE"))  # the server does that by itself after some minutes


def _fill(session: Session, numbers: range) -> None:
    session.execute(insert(RunRow), [run_row(number) for number in numbers])
    _add_analyses(session, numbers)
    postgresql = session.get_bind().dialect.name == "postgresql"
    types = {"binary": "BYTEA", "json": "JSON"} if postgresql else {"binary": "BLOB", "json": "TEXT"}
    for statement in STATEMENTS:
        session.execute(text(statement.format(**types)), {"first": numbers[0], "last": numbers[-1]})
    _add_happenings(session, numbers)


def run_row(number: int) -> dict[str, Any]:
    """A hammer run where the number is odd, else a sweep; one begins every five minutes, on one rig after the other."""
    started = datetime(2020, 1, 1, tzinfo=UTC) + timedelta(minutes=5 * number)
    state = STATES[number % len(STATES)]
    return {
        "kind": "sweep" if number % 2 == 0 else "hammer", "state": state, "title": f"run {number}",
        "article": article_of(number), "started_at": started, "finished_at": started + timedelta(hours=1),
        "setup": {"joints": [{"name": joint, "note": "x" * 500} for joint in ("I", "II")]}, "sequence": {},
        "configuration_hash": f"{number:064}", "waveform_file": f"{number}.waveforms",
        "reason": None if state is RunState.FINISHED else "stopped by the operator",
        "rig": f"rig {number // 2 % RIGS}",
    }  # fmt: skip


def article_of(number: int) -> str:
    """The article of a run; a hundred runs have it."""
    return f"beam {(number - 1) // GROUP * ARTICLES + (number - 1) // 2 % ARTICLES}"


def _add_analyses(session: Session, numbers: range) -> None:
    """Each kind that belongs to a run, the inverse ones twice: a new computation beside the old one."""
    kinds = (AnalysisKind.FREQUENCY_RESPONSES, AnalysisKind.MODES, AnalysisKind.JOINT_MATRICES) * 2
    wanted = [(kind, run) for run in numbers for kind in (kinds if run % 2 else (AnalysisKind.DYNAMIC_STIFFNESS,))]
    rows = [{"kind": kind, "method": "bench", "settings": {}, "configuration_hash": "0"} for kind, _ in wanted]
    before = session.scalar(select(func.max(AnalysisRow.id))) or 0
    session.execute(insert(AnalysisRow), rows)
    used = [{"analysis_id": before + place, "run_id": run} for place, (_, run) in enumerate(wanted, start=1)]
    session.execute(insert(AnalysisRunRow), used)


def _add_happenings(session: Session, numbers: range) -> None:
    """What the service notes of runs: history, audit log, jobs that are done, an alarm for each run that failed."""
    rows = [run_row(number) | {"id": number} for number in numbers]
    session.execute(
        insert(RunEventRow),
        [
            {"run_id": row["id"], "state": state, "happened_at": row["started_at"], "who": "bench"}
            for row in rows
            for state in (RunState.RUNNING, row["state"])
        ],
    )
    session.execute(
        insert(AuditEntryRow),
        [
            {"who": "1", "action": action, "target": f"run {row['id']}", "outcome": "done", "details": {}}
            for row in rows
            for action in ("create run", "start run", "answer prompt", "identify run")
        ],
    )
    job = {
        "kind": "identification",
        "state": JobState.DONE,
        "asked_by": "1",
        "attempts": 1,
        "cancelled": False,
        "done": 1,
        "total": 1,
    }
    session.execute(insert(JobRow), [job | {"parameters": {"run_id": number}} for number in numbers])
    session.execute(
        insert(AlarmRow),
        [
            {
                "uid": f"{row['id']}", "cause": f"run {row['id']}", "kind": AlarmKind.RUN_ENDED, "rig": row["rig"],
                "run_id": row["id"], "text": "the run failed", "happened_at": row["finished_at"],
                "acknowledged_at": row["finished_at"], "acknowledged_by": "bench",
            }
            for row in rows
            if row["state"] is RunState.FAILED
        ],
    )  # fmt: skip


def sizes_of(catalogue: Catalogue, *, empty_too: bool = False) -> dict[str, tuple[int, int]]:
    """Rows of each table, and bytes with its indices, largest first; without those that have none, or `empty_too`."""
    with catalogue.reading(long=True) as session:
        if session.get_bind().dialect.name == "postgresql":
            names = session.execute(text("SELECT relname, pg_total_relation_size(relid) FROM pg_stat_user_tables"))
        else:
            query = "SELECT tbl_name, sum(pgsize) FROM dbstat JOIN sqlite_schema USING (name) GROUP BY tbl_name"
            names = session.execute(text(query))
        sizes = {name: int(size) for name, size in names}
        rows = {name: session.scalar(text(f"SELECT count(*) FROM {name}")) or 0 for name in sizes}
    largest_first = sorted(sizes.items(), key=lambda each: -each[1])
    return {name: (rows[name], size) for name, size in largest_first if rows[name] or empty_too}
