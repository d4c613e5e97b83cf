"""Alarms, and the messages that tell of them."""

import sqlalchemy as sa
from alembic import op

from store.migrations.columns import optional, recorded, reference, required

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None

ALARMS, DELIVERIES = "alarms", "alarm_deliveries"


def upgrade() -> None:
    """Create the tables."""
    recorded(
        ALARMS,
        *required(sa.String, "uid", "cause", "kind", "rig"),
        reference("run_id", "runs", nullable=True),
        *required(sa.String, "text"),
        *required(sa.DateTime(timezone=True), "happened_at"),
        *optional(sa.DateTime(timezone=True), "acknowledged_at"),
        *optional(sa.String, "acknowledged_by", "note"),
        sa.UniqueConstraint("uid"),
        sa.UniqueConstraint("cause"),
    )
    op.create_index("ix_alarms_rig_acknowledged_at_id", ALARMS, ["rig", "acknowledged_at", "id"])
    recorded(
        DELIVERIES,
        reference("alarm_id", "alarms"),
        *required(sa.String, "channel", "body"),
        *required(sa.Integer, "attempts"),
        *optional(sa.DateTime(timezone=True), "tried_at"),
        *required(sa.DateTime(timezone=True), "next_at"),
        *optional(sa.String, "result"),
        *optional(sa.DateTime(timezone=True), "delivered_at"),
        sa.UniqueConstraint("alarm_id", "channel"),
    )


def downgrade() -> None:
    """Drop the tables; nobody is told any more of what was not delivered."""
    op.drop_table(DELIVERIES)
    op.drop_table(ALARMS)
