"""Alarms, and the messages that tell of them."""

import sqlalchemy as sa
from alembic import op

from store.migrations.versions.revision_0006_service import recorded

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None

ALARMS, DELIVERIES = "alarms", "alarm_deliveries"


def upgrade() -> None:
    """Create the tables."""
    recorded(
        ALARMS,
        sa.Column("uid", sa.String(), nullable=False),
        sa.Column("cause", sa.String(), nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("rig", sa.String(), nullable=False),
        sa.Column("run_id", sa.Integer(), sa.ForeignKey("runs.id", name="fk_alarms_run_id")),
        sa.Column("text", sa.String(), nullable=False),
        sa.Column("happened_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("acknowledged_at", sa.DateTime(timezone=True)),
        sa.Column("acknowledged_by", sa.String()),
        sa.Column("note", sa.String()),
        sa.UniqueConstraint("uid", name="uq_alarms_uid"),
        sa.UniqueConstraint("cause", name="uq_alarms_cause"),
    )
    op.create_index("ix_alarms_rig_acknowledged_at_id", ALARMS, ["rig", "acknowledged_at", "id"])
    recorded(
        DELIVERIES,
        sa.Column("alarm_id", sa.Integer(), sa.ForeignKey("alarms.id", name="fk_alarm_deliveries_alarm_id"),
                  nullable=False),
        sa.Column("channel", sa.String(), nullable=False),
        sa.Column("body", sa.String(), nullable=False),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("tried_at", sa.DateTime(timezone=True)),
        sa.Column("next_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("result", sa.String()),
        sa.Column("delivered_at", sa.DateTime(timezone=True)),
        sa.UniqueConstraint("alarm_id", "channel", name="uq_alarm_deliveries_alarm_id_channel"),
    )  # fmt: skip


def downgrade() -> None:
    """Drop the tables; nobody is told any more of what was not delivered."""
    op.drop_table(DELIVERIES)
    op.drop_table(ALARMS)
