"""How far each spool of a run is stored, so that no record of it is stored twice."""

import sqlalchemy as sa
from alembic import op

from store.migrations.versions.revision_0006_service import recorded

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None

TABLE = "spools"


def upgrade() -> None:
    """Create the table."""
    recorded(
        TABLE,
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("last_stored", sa.Integer(), nullable=False),
        sa.UniqueConstraint("name", name="uq_spools_name"),
    )


def downgrade() -> None:
    """Drop it: a spool that is stored in part would be stored from its first record again."""
    op.drop_table(TABLE)
