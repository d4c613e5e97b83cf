"""A run that has not begun has no start."""

from alembic import op

from store.migrations.versions.revision_0011_rigs_and_checksums import V_RUNS as BEFORE

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None

V_RUNS = """
CREATE VIEW v_runs AS
SELECT runs.id AS run_id, runs.kind, runs.state, runs.title, runs.article,
    CASE WHEN runs.state <> 'created' THEN runs.started_at END AS started_at, runs.finished_at, runs.reason,
    (SELECT count(*) FROM blows JOIN points ON points.id = blows.point_id
        LEFT JOIN blow_withdrawals AS taken_back ON taken_back.blow_id = blows.id
        WHERE points.run_id = runs.id AND blows.accepted AND taken_back.id IS NULL) AS blows_accepted,
    (SELECT count(*) FROM blows JOIN points ON points.id = blows.point_id
        LEFT JOIN blow_withdrawals AS taken_back ON taken_back.blow_id = blows.id
        WHERE points.run_id = runs.id AND NOT (blows.accepted AND taken_back.id IS NULL)) AS blows_refused,
    (SELECT count(*) FROM sine_records WHERE sine_records.run_id = runs.id) AS sine_records,
    runs.software_version, runs.configuration_hash, runs.waveform_file, runs.rig
FROM runs
"""


def upgrade() -> None:
    """Create the view again."""
    _replace(V_RUNS)


def downgrade() -> None:
    """Create the former view again."""
    _replace(BEFORE)


def _replace(view: str) -> None:
    op.execute("DROP VIEW v_runs")
    op.execute(view)
