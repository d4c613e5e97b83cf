"""The limits of a rig: each row has a time and the name of the person who set them."""

import sqlalchemy as sa
from alembic import op

from store.migrations.versions.revision_0006_service import never_change, recorded

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

TABLE = "rig_limits"


def upgrade() -> None:
    """Create the table."""
    recorded(
        TABLE,
        sa.Column("rig", sa.String(), nullable=False),
        sa.Column("who", sa.String(), nullable=False),
        sa.Column("limits", sa.JSON(), nullable=False),
    )
    op.create_index("ix_rig_limits_rig_id", TABLE, ["rig", "id"])
    never_change(TABLE)


def downgrade() -> None:
    """Drop the table."""
    op.drop_table(TABLE)
