"""Changes that the schema forbids, as a broken program could make them."""

import sqlite3
from contextlib import closing

from sqlalchemy import text

from store.catalogue import Catalogue

TRIGGERS = "SELECT name FROM sqlite_master WHERE type = 'trigger'"


def change_by_force(catalogue: Catalogue, statement: str) -> None:
    """Carry out a statement that triggers or foreign keys would refuse."""
    if catalogue.address.startswith("sqlite"):
        with closing(sqlite3.connect(catalogue.address.removeprefix("sqlite:///"))) as connection, connection:
            for (name,) in connection.execute(TRIGGERS).fetchall():
                connection.execute(f"DROP TRIGGER {name}")
            connection.execute(statement)
        return
    with catalogue.writing() as session:
        session.execute(text("SET LOCAL session_replication_role = replica"))
        session.execute(text(statement))
