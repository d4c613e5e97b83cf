"""The limits of a rig: each row has a time and the name of the person who set them."""

import sqlalchemy as sa
from alembic import op

from store.migrations.columns import never_change, recorded, required

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

TABLE = "rig_limits"


def upgrade() -> None:
    """Create the table."""
    recorded(TABLE, *required(sa.String, "rig", "who"), *required(sa.JSON, "limits"))
    op.create_index("ix_rig_limits_rig_id", TABLE, ["rig", "id"])
    never_change(TABLE)


def downgrade() -> None:
    """Drop the table."""
    op.drop_table(TABLE)
