"""An empty database of either kind: SQLite, and a real PostgreSQL server that the tests start once and stop."""

import shutil
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import psycopg
import pytest
from psycopg.sql import SQL, Identifier

from store.catalogue import Catalogue
from tests.postgresql_server import NotInstalledError, Server, running_server

TEMPLATE, LAB = "jointlab_template", "lab"
REVISION = "SELECT version_num FROM alembic_version"
# Triggers and foreign keys rest meanwhile: raw rows are never deleted otherwise.
EMPTY = """
    SET session_replication_role = replica;
    DO $$ DECLARE name text; BEGIN
        FOR name IN SELECT tablename FROM pg_tables WHERE schemaname = 'public' AND tablename <> 'alembic_version' LOOP
            EXECUTE format('DELETE FROM %I', name);
        END LOOP;
        INSERT INTO audit_head VALUES (1, 0, '');
        PERFORM setval(oid::regclass, 1, false) FROM pg_class WHERE relkind = 'S';
    END $$
"""
TABLES = "SELECT tablename FROM pg_tables WHERE schemaname = 'public' AND tablename <> 'alembic_version'"
COPY_OUT, COPY_IN = SQL("COPY {} TO STDOUT"), SQL("COPY {} FROM STDIN")
SEQUENCES = "SELECT sequencename, last_value FROM pg_sequences WHERE last_value IS NOT NULL"


@pytest.fixture(scope="session")
def postgresql() -> Iterator[Server]:
    """A server of this test session, with a template of an empty catalogue."""
    with ExitStack() as stack:
        try:
            server = stack.enter_context(running_server())
        except NotInstalledError as error:
            pytest.skip(f"{error}: its tests are skipped")
        server.execute("CREATE DATABASE {}", TEMPLATE)
        Catalogue.open(server.url(TEMPLATE), server.folder / "unused").close()
        yield server


def empty(server: Server, database: str) -> None:
    """Empty its tables, which is faster than a new database; where a test left another schema, renew it."""
    with server.connect(TEMPLATE) as template:
        newest = template.execute(REVISION).fetchall()
    try:
        with server.connect(database) as connection:
            if connection.execute(REVISION).fetchall() == newest:
                connection.execute(EMPTY)
                return
        server.execute("DROP DATABASE {}", database)
    except psycopg.OperationalError as error:
        assert "does not exist" in str(error)  # noqa: PT017 - the first test finds no database yet
    server.execute("CREATE DATABASE {} TEMPLATE {}", database, TEMPLATE)


@dataclass(frozen=True)
class Rows:
    """What a database on the server holds.

    Attributes:
        tables: rows of each table, as COPY writes them.
        sequences: the last number of each sequence that has given one.
    """

    tables: Mapping[str, bytes]
    sequences: Mapping[str, int]


def rows_of(server: Server, database: str) -> Rows:
    """Every row of a database, to be put into another one."""
    with server.connect(database) as connection, connection.cursor() as cursor:
        tables = {}
        for (name,) in cursor.execute(TABLES).fetchall():
            with cursor.copy(COPY_OUT.format(Identifier(str(name)))) as copy:
                tables[str(name)] = b"".join(bytes(part) for part in copy)
        sequences = {str(name): int(str(last)) for name, last in cursor.execute(SEQUENCES).fetchall()}
    return Rows(MappingProxyType(tables), MappingProxyType(sequences))


def put_rows(server: Server, database: str, rows: Rows) -> None:
    """Put rows into an empty database of the same schema, which is faster than to make them."""
    with server.connect(database) as connection, connection.cursor() as cursor:
        cursor.execute("SET session_replication_role = replica")
        cursor.execute("DELETE FROM audit_head")  # the one row of an empty database
        for name, written in rows.tables.items():
            with cursor.copy(COPY_IN.format(Identifier(name))) as copy:
                copy.write(written)
        cursor.executemany("SELECT setval(%s, %s)", list(rows.sequences.items()))


@pytest.fixture(params=["sqlite", "postgresql"])
def database_kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def database_url(database_kind: str, request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """Address of a database with an up-to-date schema and nothing in it."""
    if database_kind == "sqlite":
        shutil.copy(request.getfixturevalue("sqlite_template"), tmp_path / "lab.db")
        yield f"sqlite:///{tmp_path / 'lab.db'}"
        return
    server: Server = request.getfixturevalue("postgresql")
    empty(server, LAB)
    yield server.url(LAB)


def is_waiting(server: Server) -> bool:
    """Whether a transaction of the server waits for another one."""
    with server.connect(LAB) as connection:
        return bool(connection.execute("SELECT count(*) FROM pg_locks WHERE NOT granted").fetchall()[0][0])
