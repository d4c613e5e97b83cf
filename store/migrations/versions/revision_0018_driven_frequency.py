"""Sine records whose frequency is moved off a multiple of the mains: at which one the actuator moved."""

import sqlalchemy as sa
from alembic import op

revision = "0018"
down_revision = "0017"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    op.add_column("sine_records", sa.Column("driven_frequency", sa.Double()))


def downgrade() -> None:
    """Drop it."""
    op.drop_column("sine_records", "driven_frequency")
