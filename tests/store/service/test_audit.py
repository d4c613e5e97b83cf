"""The chain of the audit log: what was removed, changed or put elsewhere is found, however many write at once."""

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest
from sqlalchemy import text
from sqlalchemy.orm import Session

from store.backup.check import Finding, check
from store.catalogue import Catalogue
from store.errors import RESTORE, StoreError
from store.service.audit import add_audit_entry, check_head, list_audit_entries, read_chain

COLUMNS = "who, action, target, outcome, details, chain_hash, created_at, software_version"


def _add(catalogue: Catalogue, target: str) -> int:
    with catalogue.writing() as session:
        return add_audit_entry(
            session, who="bench", action="start run", target=target, outcome="done", details={"a": [1.5, "ü"]}
        )


@pytest.fixture
def head(catalogue: Catalogue) -> str:
    """Hash of the last of six entries."""
    for number in range(1, 7):
        _add(catalogue, f"run {number}")
    with catalogue.reading() as session:
        return read_chain(session).head


def _remove(number: int) -> Callable[[Session], None]:
    return lambda session: _run(session, f"DELETE FROM audit_entries WHERE id = {number}")


def _change(session: Session) -> None:
    _run(session, "UPDATE audit_entries SET who = 'somebody else' WHERE id = 3")


def _exchange(session: Session) -> None:
    for old, new in ((2, 99), (3, 2), (99, 3)):
        _run(session, f"UPDATE audit_entries SET id = {new} WHERE id = {old}")


def _insert(session: Session) -> None:
    _run(session, f"INSERT INTO audit_entries (id, {COLUMNS}) SELECT 7, {COLUMNS} FROM audit_entries WHERE id = 6")


def _run(session: Session, statement: str) -> None:
    session.execute(text(statement))


@pytest.mark.parametrize(
    ("damage", "named"),
    [
        (_remove(1), "entry 2"),
        (_remove(4), "entry 5"),
        (_remove(6), "6 entries were written, 5 are there"),
        (_change, "entry 3"),
        (_exchange, "entry 2"),
        (_insert, "entry 7"),
    ],
    ids=["first removed", "one removed", "last removed", "changed", "exchanged", "repeated"],
)
def test_a_log_that_was_tampered_with_is_found(
    catalogue: Catalogue, head: str, damage: Callable[[Session], None], named: str
) -> None:
    with catalogue.writing() as session:
        if session.get_bind().dialect.name == "postgresql":
            _run(session, "SET LOCAL session_replication_role = replica")
        else:
            for action in ("update", "delete"):
                _run(session, f"DROP TRIGGER audit_entries_are_final_{action}")
        damage(session)
    found = check(catalogue)
    assert {(finding.where, finding.remedy) for finding in found} == {("audit log", RESTORE)}
    assert named in found[0].what


def test_entries_of_many_threads_are_one_chain(catalogue: Catalogue) -> None:
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda number: _add(catalogue, f"run {number}"), range(40)))
    with catalogue.reading() as session:
        log = read_chain(session)
    assert (log.entries, log.faults, log.later) == (40, (), 0)


def test_an_entry_of_a_transaction_that_is_undone_leaves_no_gap(catalogue: Catalogue, head: str) -> None:
    def undo() -> None:
        with catalogue.writing() as session:
            add_audit_entry(session, who="bench", action="a", target="b", outcome="c")
            raise ValueError

    with pytest.raises(ValueError):  # noqa: PT011 - the one of above
        undo()
    _add(catalogue, "run 7")
    assert check(catalogue) == list[Finding]()


def test_a_log_that_was_rebuilt_as_a_whole_is_found_by_a_hash_that_was_noted(catalogue: Catalogue, head: str) -> None:
    _add(catalogue, "run 7")
    with catalogue.reading() as session:
        check_head(read_chain(session, head), head)
    with catalogue.writing() as session:
        if session.get_bind().dialect.name == "postgresql":
            _run(session, "SET LOCAL session_replication_role = replica")
        else:
            _run(session, "DROP TRIGGER audit_entries_are_final_delete")
        _run(session, "DELETE FROM audit_entries")
        _run(session, "UPDATE audit_head SET entries = 0, chain_hash = ''")
    for number in range(1, 8):
        _add(catalogue, f"run {number}")
    with catalogue.reading() as session:
        log = read_chain(session, head)
    assert log.faults == ()
    with pytest.raises(StoreError, match="entries were rewritten since it was noted"):
        check_head(log, head)


def test_an_entry_is_kept_whatever_somebody_gave(catalogue: Catalogue) -> None:
    details = {"name\udcff": ["\ud800", math.nan, math.inf, 1.5]}
    with catalogue.writing() as session:
        add_audit_entry(session, who="w\ud800", action="a\ud800", target="t\ud800", outcome="o\ud800", details=details)
    with catalogue.reading() as session:
        (entry,) = list_audit_entries(session)
        assert read_chain(session).faults == ()
    assert (entry.who, entry.action, entry.target, entry.outcome) == ("w\ufffd", "a\ufffd", "t\ufffd", "o\ufffd")
    assert entry.details == {"name\ufffd": ["\ufffd", "nan", "inf", 1.5]}
