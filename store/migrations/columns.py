"""What revisions create tables from. Constraints get their names by the convention of `store.models.base`."""

from typing import Any

import sqlalchemy as sa
from alembic import op

Index = tuple[str, str, list[str]]
"""Name, table, columns."""
Kind = type[sa.types.TypeEngine[Any]] | sa.types.TypeEngine[Any]


def required(kind: Kind, *names: str) -> tuple[sa.Column[Any], ...]:
    """Columns of one type that always have a value."""
    return tuple(sa.Column(name, kind, nullable=False) for name in names)


def optional(kind: Kind, *names: str) -> tuple[sa.Column[Any], ...]:
    """Columns of one type that may be null."""
    return tuple(sa.Column(name, kind) for name in names)


def reference(name: str, table: str, *, nullable: bool = False, primary_key: bool = False) -> sa.Column[int]:
    """A column with the id of a row of `table`."""
    of = sa.ForeignKey(f"{table}.id")
    return sa.Column(name, sa.Integer, of, nullable=nullable, primary_key=primary_key)


def key(name: str, table: str) -> sa.Column[int]:
    """A column with the id of a row of `table`, which is part of the primary key."""
    return reference(name, table, primary_key=True)


def recorded(table: str, *columns: Any) -> None:
    """Create a table with the columns that every one has."""
    op.create_table(
        table,
        sa.Column("id", sa.Integer, primary_key=True),
        *columns,
        *required(sa.DateTime(timezone=True), "created_at"),
        *required(sa.String, "software_version"),
    )


def drop(*tables: str) -> None:
    """Drop tables in the order given, with all that is in them."""
    for table in tables:
        op.drop_table(table)


def never_change(table: str) -> None:
    """Refuse to change or delete rows."""
    if op.get_bind().dialect.name == "postgresql":
        op.execute(
            f"CREATE TRIGGER {table}_are_final BEFORE UPDATE OR DELETE ON {table} "
            "FOR EACH ROW EXECUTE FUNCTION raw_data_are_final()"
        )
        return
    for action in ("UPDATE", "DELETE"):
        op.execute(
            f"CREATE TRIGGER {table}_are_final_{action.lower()} BEFORE {action} ON {table} "
            "BEGIN SELECT RAISE(ABORT, 'raw data are never changed or deleted'); END"
        )


def may_change(table: str) -> None:
    """Take `never_change` back."""
    if op.get_bind().dialect.name == "postgresql":
        op.execute(f"DROP TRIGGER {table}_are_final ON {table}")
        return
    for action in ("update", "delete"):
        op.execute(f"DROP TRIGGER {table}_are_final_{action}")


def replace_indices(old: tuple[Index, ...], new: tuple[Index, ...]) -> None:
    """Drop the old indices, and create the new ones."""
    for name, table, _ in old:
        op.drop_index(name, table)
    for name, table, columns in new:
        op.create_index(name, table, columns)


def replace_views(views: dict[str, str]) -> None:
    """Create views again, given in the order of creation: later ones stand on earlier ones."""
    for name in reversed(views):
        op.execute(f"DROP VIEW {name}")
    for statement in views.values():
        op.execute(statement)
