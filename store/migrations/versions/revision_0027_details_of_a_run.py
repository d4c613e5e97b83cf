"""What an instrument said of itself to a run, such as the limits of the tester: they change from run to run.

Rows of older runs have none; of their instruments is known what they said to the first run that used them.
"""

import sqlalchemy as sa
from alembic import op

revision = "0027"
down_revision = "0026"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    op.add_column("run_instruments", sa.Column("details", sa.JSON(none_as_null=True)))


def downgrade() -> None:
    """Drop it with what it holds."""
    op.drop_column("run_instruments", "details")
