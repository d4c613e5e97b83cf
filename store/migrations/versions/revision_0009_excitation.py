"""What excited a set of accelerances: a hammer, or the sine of a shaker."""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

TABLE = "frequency_response_sets"


def upgrade() -> None:
    """Add the column; every set so far was a hammer's."""
    op.add_column(TABLE, sa.Column("excitation", sa.String(), nullable=False, server_default="hammer"))


def downgrade() -> None:
    """Drop it."""
    op.drop_column(TABLE, "excitation")
