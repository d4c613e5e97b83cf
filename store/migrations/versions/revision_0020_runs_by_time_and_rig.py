"""Indices for runs that began on some days, and for those of a rig, among millions of others."""

from alembic import op

revision = "0020"
down_revision = "0019"
branch_labels = None
depends_on = None

COLUMNS = ("started_at", "rig")


def upgrade() -> None:
    """Create the indices."""
    for name in COLUMNS:
        op.create_index(f"ix_runs_{name}_id", "runs", [name, "id"])


def downgrade() -> None:
    """Drop them."""
    for name in COLUMNS:
        op.drop_index(f"ix_runs_{name}_id", "runs")
