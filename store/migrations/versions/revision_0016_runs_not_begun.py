"""A run that has not begun has no start."""

from alembic import op

from store.migrations.versions.revision_0011_rigs_and_checksums import V_RUNS as BEFORE

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None

STARTED = "CASE WHEN runs.state <> 'created' THEN runs.started_at END AS started_at"
V_RUNS = BEFORE.replace("runs.started_at", STARTED)


def upgrade() -> None:
    """Create the view again."""
    _replace(V_RUNS)


def downgrade() -> None:
    """Create the former view again."""
    _replace(BEFORE)


def _replace(view: str) -> None:
    op.execute("DROP VIEW v_runs")
    op.execute(view)
