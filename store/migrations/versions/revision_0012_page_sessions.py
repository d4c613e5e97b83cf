"""Sessions of the page: a random secret in the browser in place of the key itself."""

import sqlalchemy as sa
from alembic import op

from store.migrations.columns import recorded, reference, required

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None

TABLE = "page_sessions"


def upgrade() -> None:
    """Create the table."""
    recorded(
        TABLE,
        *required(sa.String, "digest"),
        reference("key_id", "api_keys"),
        *required(sa.DateTime(timezone=True), "ends_at"),
        sa.UniqueConstraint("digest"),
    )


def downgrade() -> None:
    """Drop the table; everybody logs in once more."""
    op.drop_table(TABLE)
