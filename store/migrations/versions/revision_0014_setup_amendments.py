"""Corrected descriptions of how a run was measured, beside the one of the measurement itself."""

import sqlalchemy as sa
from alembic import op

from store.migrations.columns import never_change, recorded, reference, required

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None

TABLE = "setup_amendments"


def upgrade() -> None:
    """Create the table."""
    recorded(
        TABLE,
        reference("run_id", "runs"),
        *required(sa.Integer, "version"),
        *required(sa.JSON, "setup"),
        *required(sa.String, "reason", "who"),
        sa.Column("checksum", sa.String, nullable=False, server_default=""),
        sa.UniqueConstraint("run_id", "version"),
    )
    never_change(TABLE)


def downgrade() -> None:
    """Drop it with its rows; runs are described as they were measured."""
    op.drop_table(TABLE)
