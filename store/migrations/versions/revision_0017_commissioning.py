"""Commissioning records; of calibrations the uncertainty, the certificate and the day until which they hold."""

from typing import Any

import sqlalchemy as sa
from alembic import op

from store.migrations.columns import never_change, recorded, required

revision = "0017"
down_revision = "0016"
branch_labels = None
depends_on = None

TABLE = "commissioning_records"
COLUMNS: tuple[tuple[str, sa.types.TypeEngine[Any]], ...] = (
    ("uncertainty", sa.Double()),
    ("certificate", sa.String()),
    ("due_on", sa.Date()),
)


def upgrade() -> None:
    """Create the table and the columns."""
    recorded(
        TABLE,
        *required(sa.String, "rig", "place", "who", "verdict"),
        *required(sa.JSON, "checks", "instruments"),
        sa.Column("checksum", sa.String, nullable=False, server_default=""),
    )
    op.create_index("ix_commissioning_records_rig_id", TABLE, ["rig", "id"])
    never_change(TABLE)
    for name, kind in COLUMNS:
        op.add_column("calibrations", sa.Column(name, kind))


def downgrade() -> None:
    """Drop them with what they hold."""
    op.drop_table(TABLE)
    for name, _ in reversed(COLUMNS):
        op.drop_column("calibrations", name)
