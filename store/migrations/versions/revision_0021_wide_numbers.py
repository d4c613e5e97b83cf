"""Numbers of sine points with 8 bytes on PostgreSQL: with 4, two hundred rigs have used them up after four years."""

import sqlalchemy as sa
from alembic import op

revision = "0021"
down_revision = "0020"
branch_labels = None
depends_on = None

COLUMNS = {"sine_records": ("id",), "dynamic_stiffness": ("id", "sine_record_id")}
VIEWS = (
    "SELECT relname, pg_get_viewdef(oid) FROM pg_class "
    "WHERE relkind = 'v' AND relnamespace = current_schema()::regnamespace ORDER BY oid"
)
"""Names and statements of all views, later ones standing on earlier ones."""


def upgrade() -> None:
    """Widen the columns and what counts them; PostgreSQL writes both tables again."""
    _retype("bigint")


def downgrade() -> None:
    """Make them narrow again; PostgreSQL refuses that where a number is too large."""
    _retype("integer")


def _retype(kind: str) -> None:
    bind = op.get_bind()
    if bind.dialect.name != "postgresql":
        return  # numbers of SQLite always have 8 bytes
    views = bind.execute(sa.text(VIEWS)).all()
    for name, _ in reversed(views):  # a view holds the types of its columns fast
        op.execute(f'DROP VIEW "{name}"')
    for table, columns in COLUMNS.items():
        op.execute(f"ALTER TABLE {table} " + ", ".join(f"ALTER COLUMN {column} TYPE {kind}" for column in columns))
        op.execute(f"ALTER SEQUENCE {table}_id_seq AS {kind}")
    for name, definition in views:
        op.execute(f'CREATE VIEW "{name}" AS {definition}')
