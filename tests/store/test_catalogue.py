"""Opening a catalogue: what it creates, what it refuses, and how it says so."""

import sqlite3
import subprocess
import sys
from pathlib import Path

import psycopg
import pytest
from sqlalchemy import text

from store.catalogue import Catalogue
from store.database.time_limits import TimeLimits
from store.errors import StoreError
from store.measurements.runs import get_run, list_runs, start_run
from store.states import RunState


def _start(opened: Catalogue, title: str = "beam 3") -> int:
    with opened.writing() as session:
        return start_run(session, kind="hammer", title=title, article="beam 3", setup={}).id


def test_an_empty_database_gets_its_tables_once(empty_database_url: str, tmp_path: Path) -> None:
    with Catalogue.open(empty_database_url, tmp_path) as first:
        run = _start(first)
    with Catalogue.open(empty_database_url, tmp_path) as second, second.reading() as session:
        assert get_run(session, run).state is RunState.RUNNING


def test_a_database_of_a_newer_version_is_refused_by_its_revision(database_url: str, tmp_path: Path) -> None:
    with Catalogue.open(database_url, tmp_path) as opened, opened.writing() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    with pytest.raises(StoreError, match=r"schema revision 9999.*update jointlab"):
        Catalogue.open(database_url, tmp_path)


def test_a_database_with_other_peoples_tables_is_refused(empty_database_url: str, tmp_path: Path) -> None:
    with Catalogue.open(empty_database_url, tmp_path) as opened, opened.writing() as session:
        session.execute(text("DELETE FROM alembic_version"))
    with pytest.raises(StoreError, match=r"not jointlab's .*analyses"):
        Catalogue.open(empty_database_url, tmp_path)


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("nonsense", "not the address of a database"),
        ("mysql://host/lab", "'mysql' is not supported"),
        ("sqlite://", "in memory"),
        ("sqlite:///:memory:", "in memory"),
        ("sqlite:////nowhere/at/all/lab.db", "no folder /nowhere/at/all"),
        ("postgresql://host/lab", "set the folder of waveforms"),
    ],
)
def test_an_address_that_cannot_work_is_refused(url: str, said: str) -> None:
    with pytest.raises(StoreError, match=said):
        Catalogue.open(url)


def test_a_server_that_is_not_there_is_named_without_the_password(tmp_path: Path) -> None:
    with pytest.raises(StoreError) as caught:
        Catalogue.open(f"postgresql://someone:secret@/lab?host={tmp_path}", tmp_path)
    assert "someone" in str(caught.value)
    assert "secret" not in str(caught.value)


def test_a_file_that_is_no_database_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "lab.db").write_bytes(b"no database " * 100)
    with pytest.raises(StoreError, match="file is not a database") as caught:
        Catalogue.open(f"sqlite:///{tmp_path / 'lab.db'}")
    assert "\n" not in str(caught.value)


def test_an_error_in_a_transaction_undoes_all_of_it(catalogue: Catalogue) -> None:
    def store_and_fail() -> None:
        with catalogue.writing() as session:
            start_run(session, kind="hammer", title="a", article="a", setup={})
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        store_and_fail()
    with catalogue.reading() as session:
        assert list_runs(session) == []


def test_a_rule_of_the_schema_that_is_broken_is_an_error_of_the_store(catalogue: Catalogue) -> None:
    with pytest.raises(StoreError, match=r"(?i)not.null"), catalogue.writing() as session:
        session.execute(text("INSERT INTO specimens (article) VALUES ('a')"))


def test_a_call_that_outlives_its_catalogue_closes_its_connection(catalogue: Catalogue) -> None:
    with catalogue.reading() as session:
        list_runs(session)
        connection = session.connection().connection.driver_connection
        assert connection is not None
        catalogue.close()
    with pytest.raises((sqlite3.ProgrammingError, psycopg.OperationalError), match="closed"):
        connection.execute("SELECT 1")


def test_sqlite_is_set_for_safety(tmp_path: Path) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'lab.db'}") as opened, opened.reading() as session:
        pragmas = {
            name: session.scalar(text(f"PRAGMA {name}")) for name in ("journal_mode", "synchronous", "foreign_keys")
        }
    assert pragmas == {"journal_mode": "wal", "synchronous": 2, "foreign_keys": 1}


def test_waveforms_are_beside_an_sqlite_file_by_default(tmp_path: Path) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'lab.db'}") as opened:
        assert opened.waveforms.folder == tmp_path / "lab-waveforms"


def test_a_reader_sees_one_state_while_a_writer_commits(catalogue: Catalogue) -> None:
    with catalogue.reading() as session:
        assert list_runs(session) == []
        _start(catalogue)
        assert list_runs(session) == []
    with catalogue.reading() as session:
        assert len(list_runs(session)) == 1


def test_a_database_locked_by_another_program_is_said(tmp_path: Path) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'lab.db'}", limits=TimeLimits(lock=0.05)) as opened:
        other = sqlite3.connect(tmp_path / "lab.db", isolation_level=None)
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(StoreError, match="database is locked"):
            _start(opened)
        other.execute("ROLLBACK")
        other.close()
        assert _start(opened) == 1


def test_a_full_disk_is_reported_and_nothing_is_half_stored(tmp_path: Path) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'lab.db'}") as opened:
        with opened.reading() as session:
            pages = session.scalar(text("PRAGMA page_count"))
            session.execute(text(f"PRAGMA max_page_count = {pages}"))
        with pytest.raises(StoreError, match="disk is full"):
            _start(opened, "x" * 1_000_000)
        with opened.reading() as session:
            assert list_runs(session) == []


CRASH = """
import os, signal, sys
from pathlib import Path
from store.catalogue import Catalogue
from store.measurements.runs import start_run
catalogue = Catalogue.open(sys.argv[1], Path(sys.argv[2]))
with catalogue.writing() as session:
    start_run(session, kind="hammer", title="kept", article="a", setup={})
with catalogue.writing() as session:
    start_run(session, kind="hammer", title="lost", article="a", setup={})
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_killed_process_leaves_exactly_its_commits(database_url: str, tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-c", CRASH, database_url, str(tmp_path)], check=False)
    with Catalogue.open(database_url, tmp_path) as opened, opened.reading() as session:
        assert [run.title for run in list_runs(session)] == ["kept"]
