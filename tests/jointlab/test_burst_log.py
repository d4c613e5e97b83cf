"""The log of bursts: the first is noted at once, the others are counted."""

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from jointlab.burst_log import MANY, MOST_BURSTS, AuditEvent, BurstLog
from store.catalogue import Catalogue
from store.service.audit import AuditEntry, list_audit_entries
from tests.store.another_process import another_process, holding_script
from tests.waiting import until

STOP = AuditEvent("unknown caller at 127.0.0.1", "stop", "rig", "done")
LONG = 600.0  # s


@pytest.fixture
def catalogue(database_url: str, tmp_path: Path) -> Iterator[Catalogue]:
    with Catalogue.open(database_url, tmp_path / "waveforms") as opened:
        yield opened


def entries(catalogue: Catalogue) -> list[AuditEntry]:
    with catalogue.reading() as session:
        return list_audit_entries(session, limit=1000)[::-1]


def test_a_thousand_at_once_from_many_threads_are_two_rows(catalogue: Catalogue) -> None:
    bursts = BurstLog(LONG)

    def stop() -> None:
        for _ in range(100):
            bursts.note(catalogue, STOP)

    threads = [threading.Thread(target=stop) for _ in range(10)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    until(lambda: len(entries(catalogue)) == 1)  # the first one, without waiting for the end of the interval
    bursts.close()
    first, others = entries(catalogue)
    assert (first.who, first.action, first.target, first.outcome, first.details) == (
        "unknown caller at 127.0.0.1", "stop", "rig", "done", {}
    )  # fmt: skip
    assert others.details["times"] == 999


def test_one_after_the_burst_is_noted_at_once_again(catalogue: Catalogue) -> None:
    bursts = BurstLog(0.05)
    for _ in range(3):
        bursts.note(catalogue, STOP)
        until(lambda: not bursts.is_open)
    assert [entry.details for entry in entries(catalogue)] == [{}, {}, {}]


def test_different_callers_and_outcomes_are_kept_apart_until_they_are_too_many(catalogue: Catalogue) -> None:
    bursts = BurstLog(LONG)
    for number in range(10 * MOST_BURSTS):
        bursts.note(catalogue, AuditEvent(f"caller {number}", "log in", "page", "refused"))
    bursts.close()
    noted = entries(catalogue)
    assert len(noted) == MOST_BURSTS + 2
    (counted,) = [entry for entry in noted if entry.details]
    assert (counted.who, counted.details["times"]) == (MANY, 9 * MOST_BURSTS - 1)


def test_a_database_that_is_locked_delays_nobody(catalogue: Catalogue, database_url: str) -> None:
    bursts = BurstLog(LONG)
    with another_process(holding_script(database_url)):
        for _ in range(1000):
            bursts.note(catalogue, STOP)
        assert bursts.is_open
    bursts.close()
    assert [entry.details.get("times") for entry in entries(catalogue)] == [None, 999]
