"""An empty database of either kind: SQLite, and a real PostgreSQL server that the tests start once and stop."""

import shutil
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import psycopg
import pytest

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
