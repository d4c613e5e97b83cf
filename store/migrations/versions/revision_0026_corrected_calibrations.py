"""A calibration of the same day and sensitivity with another certificate, unit, uncertainty or end is another one.

A row is never changed, and the former constraint left no room for a second one: what was new was not stored.
"""

import re

import sqlalchemy as sa
from alembic import op

from store.migrations.columns import never_change

revision = "0026"
down_revision = "0025"
branch_labels = None
depends_on = None

TABLE = "calibrations"
COLUMNS = ("instrument_id", "calibrated_on", "sensitivity")
CONSTRAINT = f"uq_calibrations_{'_'.join(COLUMNS)}"
INDEX = "ix_calibrations_instrument_id"
UNIQUE = f"CONSTRAINT {CONSTRAINT} UNIQUE ({', '.join(COLUMNS)})"


def upgrade() -> None:
    """Drop the constraint, and index the instruments without it."""
    if op.get_bind().dialect.name == "sqlite":
        statement, dropped = re.subn(rf",\s*{re.escape(UNIQUE)}", "", _definition())
        assert dropped == 1, "revision 1 made this constraint"
        _make_again(statement)
    else:
        op.drop_constraint(CONSTRAINT, TABLE)
    op.create_index(INDEX, TABLE, ["instrument_id"])


def downgrade() -> None:
    """Create the constraint again; the database refuses where calibrations differ in the other columns only."""
    op.drop_index(INDEX, TABLE)
    if op.get_bind().dialect.name == "sqlite":
        _make_again(re.sub(r"\)\s*$", f", {UNIQUE})", _definition()))
    else:
        op.create_unique_constraint(CONSTRAINT, TABLE, list(COLUMNS))


def _definition() -> str:
    return str(op.get_bind().scalar(sa.text("SELECT sql FROM sqlite_master WHERE name = :name"), {"name": TABLE}))


def _make_again(statement: str) -> None:
    """Make the table again with its rows: SQLite cannot take a constraint from a table that is there.

    References to its rows are looked at when the transaction ends, and hold again by then.
    """
    op.execute("PRAGMA defer_foreign_keys = ON")
    op.execute(f"CREATE TEMP TABLE kept AS SELECT * FROM {TABLE}")
    op.execute(f"DROP TABLE {TABLE}")
    op.execute(statement)
    op.execute(f"INSERT INTO {TABLE} SELECT * FROM kept")
    op.execute("DROP TABLE kept")
    never_change(TABLE)
