"""Corrected descriptions of how a run was measured, beside the one of the measurement itself."""

import sqlalchemy as sa
from alembic import op

from store.migrations.versions.revision_0006_service import never_change, recorded

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None

TABLE = "setup_amendments"


def upgrade() -> None:
    """Create the table."""
    recorded(
        TABLE,
        sa.Column("run_id", sa.Integer(), sa.ForeignKey("runs.id", name="fk_setup_amendments_run_id"), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("setup", sa.JSON(), nullable=False),
        sa.Column("reason", sa.String(), nullable=False),
        sa.Column("who", sa.String(), nullable=False),
        sa.Column("checksum", sa.String(), nullable=False, server_default=""),
        sa.UniqueConstraint("run_id", "version", name="uq_setup_amendments_run_id_version"),
    )
    never_change(TABLE)


def downgrade() -> None:
    """Drop it with its rows; runs are described as they were measured."""
    op.drop_table(TABLE)
