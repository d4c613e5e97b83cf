"""`jointlab alarms`, and the audit log that raises one."""

import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from store.catalogue import Catalogue
from store.service.audit import add_audit_entry
from tests.api.conftest import Command

Query = Callable[[str], list[tuple[object, ...]]]


def test_a_test_is_raised_listed_and_acknowledged(jointlab: Command, query: Query) -> None:
    assert jointlab("alarms", "list").stdout == "no alarm is active\n"
    assert jointlab("alarms", "test").stdout == "alarm 1 raised; jointlab alarms list says who was notified\n"
    assert "this is a test" in jointlab("alarms", "list").stdout
    assert jointlab("alarms", "acknowledge", 1, "--note", "it works").returncode == 0
    assert jointlab("alarms", "list").stdout == "no alarm is active\n"
    assert "this is a test" in jointlab("alarms", "list", "--all").stdout
    assert query("SELECT note, acknowledged_by IS NULL FROM alarms") == [("it works", 0)]
    assert query("SELECT action, target FROM audit_entries ORDER BY id") == [
        ("test alarms", "alarms"), ("acknowledge alarm", "alarm 1"),
    ]  # fmt: skip


def test_an_alarm_that_is_not_there_is_named(jointlab: Command) -> None:
    refused = jointlab("alarms", "acknowledge", 7)
    assert (refused.returncode, "there is no alarm 7" in refused.stderr) == (3, True)


def test_a_damaged_audit_log_raises_one_alarm_where_that_is_asked_for(
    jointlab: Command, query: Query, tmp_path: Path
) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue, catalogue.writing() as session:
        for number in (1, 2):
            add_audit_entry(session, who="bench", action="start run", target=f"run {number}", outcome="done")
    assert jointlab("store", "audit", "--alarm").returncode == 0
    assert query("SELECT count(*) FROM alarms") == [(0,)]
    with closing(sqlite3.connect(tmp_path / "jointlab.db")) as connection:
        connection.execute("DROP TRIGGER audit_entries_are_final_update")
        connection.execute("UPDATE audit_entries SET who = 'nobody' WHERE id = 1")
        connection.commit()
    assert jointlab("store", "audit").returncode == 3
    assert query("SELECT count(*) FROM alarms") == [(0,)]
    for _ in range(2):
        assert jointlab("store", "audit", "--alarm").returncode == 3
    ((kind, text),) = query("SELECT kind, text FROM alarms")
    assert (kind, "entry 1 was changed" in str(text)) == ("audit_damaged", True)
