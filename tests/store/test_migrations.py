"""The schema: migrations make what the models say, go up and down with data in them, and are packaged."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import inspect, text

import store.migrations.versions
from store.catalogue import Catalogue
from store.errors import StoreError
from store.migrate import configuration
from store.models import Base
from store.runs import get_run

VIEWS = {
    "v_runs", "v_blows", "v_analyses", "v_modes", "v_joint_stiffness", "v_dynamic_stiffness", "v_comparison"
}  # fmt: skip


def _migrate(opened: Catalogue, revision: str) -> None:
    with opened.writing() as session:
        current = MigrationContext.configure(session.connection()).get_current_revision() or ""
        step = command.downgrade if revision == "base" or revision < current else command.upgrade
        step(configuration(session.connection()), revision)


def test_the_migrations_make_what_the_models_say(catalogue: Catalogue) -> None:
    with catalogue.reading() as session:
        context = MigrationContext.configure(session.connection(), opts={"compare_type": True})
        assert compare_metadata(context, Base.metadata) == []


def test_every_view_is_there(catalogue: Catalogue) -> None:
    with catalogue.reading() as session:
        assert set(inspect(session.connection()).get_view_names()) == VIEWS


def test_revisions_are_one_line_without_branches() -> None:
    script = ScriptDirectory.from_config(configuration())
    revisions = [revision.revision for revision in script.walk_revisions()]
    assert revisions == sorted(revisions, reverse=True)
    assert len(script.get_heads()) == 1


def test_data_survive_a_way_down_and_up_again(
    catalogue: Catalogue, filled: int, row_counts: Callable[[], dict[str, int]]
) -> None:
    before = row_counts()
    _migrate(catalogue, "0002")
    with catalogue.reading() as session:
        assert session.scalar(text("SELECT count(*) FROM blows")) == before["blows"]
    _migrate(catalogue, "0004")
    assert row_counts() == before
    with catalogue.reading() as session:
        assert get_run(session, filled).article == "beam 3"
        assert session.scalar(text("SELECT count(*) FROM v_blows")) == before["blows"]


def test_the_way_down_to_nothing_and_up_again(catalogue: Catalogue, filled: int) -> None:
    _migrate(catalogue, "base")
    with catalogue.reading() as session:
        assert inspect(session.connection()).get_table_names() == ["alembic_version"]
    _migrate(catalogue, "0004")
    with catalogue.reading() as session:
        assert set(inspect(session.connection()).get_table_names()) == {*Base.metadata.tables, "alembic_version"}


def test_an_older_database_is_brought_up_to_date_when_it_is_opened(
    catalogue: Catalogue, database_url: str, filled: int, tmp_path: Path
) -> None:
    _migrate(catalogue, "0002")
    with Catalogue.open(database_url, tmp_path) as opened, opened.reading() as session:
        assert session.scalar(text("SELECT count(*) FROM v_runs")) == 2


def test_an_upgrade_that_fails_leaves_the_database_as_it_was(
    empty_database_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = command.upgrade

    def fail_half_way(config: Config, revision: str) -> None:
        whole(config, "0001")
        config.attributes["connection"].execute(text("SELECT * FROM no_such_table"))

    monkeypatch.setattr("store.migrate.command.upgrade", fail_half_way)
    with pytest.raises(StoreError, match="no_such_table"):
        Catalogue.open(empty_database_url, tmp_path)
    monkeypatch.undo()
    with Catalogue.open(empty_database_url, tmp_path) as opened, opened.reading() as session:
        assert set(inspect(session.connection()).get_view_names()) == VIEWS


def test_the_revisions_are_modules_of_the_package_so_that_a_wheel_holds_them() -> None:
    folder = Path(store.migrations.versions.__file__).parent
    assert (folder.parent / "env.py").is_file()
    assert [path.name for path in sorted(folder.glob("revision_*.py"))] == [
        "revision_0001_measurements.py",
        "revision_0002_results.py",
        "revision_0003_views.py",
        "revision_0004_run_events.py",
    ]


def test_an_sqlite_database_can_be_opened_by_two_at_once(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    with ThreadPoolExecutor(4) as pool:
        for opened in pool.map(lambda _: Catalogue.open(url), range(4)):
            opened.close()
