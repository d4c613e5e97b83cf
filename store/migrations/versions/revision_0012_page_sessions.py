"""Sessions of the page: a random secret in the browser in place of the key itself."""

import sqlalchemy as sa
from alembic import op

from store.migrations.versions.revision_0006_service import recorded

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None

TABLE = "page_sessions"


def upgrade() -> None:
    """Create the table."""
    recorded(
        TABLE,
        sa.Column("digest", sa.String(), nullable=False),
        sa.Column("key_id", sa.Integer(), sa.ForeignKey("api_keys.id", name="fk_page_sessions_key_id"), nullable=False),
        sa.Column("ends_at", sa.DateTime(timezone=True), nullable=False),
        sa.UniqueConstraint("digest", name="uq_page_sessions_digest"),
    )


def downgrade() -> None:
    """Drop the table; everybody logs in once more."""
    op.drop_table(TABLE)
