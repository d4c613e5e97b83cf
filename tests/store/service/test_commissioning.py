"""Commissioning records: signed in the audit log, listed by rig, and never changed."""

import pytest
from sqlalchemy import text

from store.catalogue import Catalogue
from store.errors import StoreError
from store.service.audit import list_audit_entries
from store.service.commissioning import add_commissioning_record, get_commissioning_record, list_commissioning_records
from store.states import Verdict

CHECK = {"id": "noise", "subject": "hammer", "state": "passed", "measured": 0.02, "limit": 0.04, "unit": "N"}


def add(catalogue: Catalogue, rig: str, verdict: Verdict = Verdict.PASSED) -> int:
    with catalogue.writing() as session:
        return add_commissioning_record(
            session,
            rig=rig,
            place="bench",
            who="ann",
            verdict=verdict,
            checks=[CHECK],
            instruments=[{"kind": "tester"}],
        ).id


def test_a_record_is_kept_as_it_was_signed(catalogue: Catalogue) -> None:
    number = add(catalogue, "rig", Verdict.FAILED)
    with catalogue.reading() as session:
        record = get_commissioning_record(session, number)
        entry = list_audit_entries(session, action="sign commissioning")[0]
    assert (record.who, record.verdict, record.checks, record.instruments) == (
        "ann", Verdict.FAILED, (CHECK,), ({"kind": "tester"},),
    )  # fmt: skip
    assert (entry.who, entry.target) == ("ann", f"commissioning record {number}")
    assert entry.details == {"verdict": "failed", "checksum": record.checksum}


def test_records_are_listed_by_rig_with_the_newest_first(catalogue: Catalogue) -> None:
    first, _, last = add(catalogue, "rig"), add(catalogue, "other"), add(catalogue, "rig")
    with catalogue.reading() as session:
        assert [each.id for each in list_commissioning_records(session, rig="rig")] == [last, first]
        assert list_commissioning_records(session, rig="rig", place="mass") == []


@pytest.mark.parametrize(
    "statement", ["UPDATE commissioning_records SET verdict = 'passed'", "DELETE FROM commissioning_records"]
)
def test_a_record_is_never_changed(catalogue: Catalogue, statement: str) -> None:
    add(catalogue, "rig", Verdict.FAILED)
    with pytest.raises(StoreError, match="never changed or deleted"), catalogue.writing() as session:
        session.execute(text(statement))
