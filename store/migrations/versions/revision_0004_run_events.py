"""The history of every run: since runs can be resumed, one row of `runs` no longer tells how they ended before."""

import sqlalchemy as sa
from alembic import op

from store.migrations.columns import never_change, optional, recorded, reference, required

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

TABLE = "run_events"


def upgrade() -> None:
    """Create the table, with what the rows of `runs` tell of their start and end."""
    recorded(
        TABLE,
        reference("run_id", "runs"),
        *required(sa.String, "state"),
        *optional(sa.String, "reason", "who"),
        *required(sa.DateTime(timezone=True), "happened_at"),
    )
    op.create_index("ix_run_events_run_id", TABLE, ["run_id"])
    columns = "run_id, state, reason, happened_at, created_at, software_version"
    op.execute(
        f"INSERT INTO {TABLE} ({columns}) SELECT id, 'running', NULL, started_at, created_at, software_version "
        "FROM runs ORDER BY id"
    )
    op.execute(
        f"INSERT INTO {TABLE} ({columns}) SELECT id, state, reason, coalesce(finished_at, created_at), created_at, "
        "software_version FROM runs WHERE state <> 'running' ORDER BY id"
    )
    never_change(TABLE)


def downgrade() -> None:
    """Drop the table and with it its triggers."""
    op.drop_table(TABLE)
