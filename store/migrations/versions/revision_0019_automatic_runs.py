"""Runs in which a program does what operators do: they are resumed so, also by a program that did not begin them."""

import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    op.add_column("runs", sa.Column("automatic", sa.Boolean()))


def downgrade() -> None:
    """Drop it."""
    op.drop_column("runs", "automatic")
