"""How far each spool of a run is stored, so that no record of it is stored twice."""

import sqlalchemy as sa
from alembic import op

from store.migrations.columns import recorded, required

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None

TABLE = "spools"


def upgrade() -> None:
    """Create the table."""
    recorded(TABLE, *required(sa.String, "name"), *required(sa.Integer, "last_stored"), sa.UniqueConstraint("name"))


def downgrade() -> None:
    """Drop it: a spool that is stored in part would be stored from its first record again."""
    op.drop_table(TABLE)
