"""The polarity of each channel of a run, so that a run that goes on is not measured with another one.

Rows of older runs have none: it is not known, and is not compared.
"""

import sqlalchemy as sa
from alembic import op

revision = "0028"
down_revision = "0027"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    op.add_column("channels", sa.Column("polarity", sa.Integer()))


def downgrade() -> None:
    """Drop it with what it holds."""
    op.drop_column("channels", "polarity")
