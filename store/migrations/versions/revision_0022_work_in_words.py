"""Jobs: what their worker does now, in words, such as the first answer of a diagnosis."""

import sqlalchemy as sa
from alembic import op

revision = "0022"
down_revision = "0021"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    op.add_column("jobs", sa.Column("now", sa.String()))


def downgrade() -> None:
    """Drop it."""
    op.drop_column("jobs", "now")
