"""The history of every run: since runs can be resumed, one row of `runs` no longer tells how they ended before."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

TABLE = "run_events"


def upgrade() -> None:
    """Create the table, with what the rows of `runs` tell of their start and end."""
    op.create_table(
        TABLE,
        sa.Column("id", sa.Integer(), primary_key=True),
        sa.Column("run_id", sa.Integer(), sa.ForeignKey("runs.id", name="fk_run_events_run_id"), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("reason", sa.String()),
        sa.Column("who", sa.String()),
        sa.Column("happened_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("software_version", sa.String(), nullable=False),
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
    if op.get_bind().dialect.name == "postgresql":
        op.execute(
            f"CREATE TRIGGER {TABLE}_are_final BEFORE UPDATE OR DELETE ON {TABLE} "
            "FOR EACH ROW EXECUTE FUNCTION raw_data_are_final()"
        )
        return
    for action in ("UPDATE", "DELETE"):
        op.execute(
            f"CREATE TRIGGER {TABLE}_are_final_{action.lower()} BEFORE {action} ON {TABLE} "
            "BEGIN SELECT RAISE(ABORT, 'raw data are never changed or deleted'); END"
        )


def downgrade() -> None:
    """Drop the table and with it its triggers."""
    op.drop_table(TABLE)
