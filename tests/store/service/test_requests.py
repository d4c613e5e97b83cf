"""Idempotency keys: old ones are removed, and a clock that is set forwards removes none of the newest."""

from datetime import UTC, datetime, timedelta

from sqlalchemy import update

from store.catalogue import Catalogue
from store.models.service import RequestRow
from store.service.requests import begin_request, find_request, remove_old_requests


def test_only_requests_that_are_old_and_not_among_the_newest_are_removed(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        for number in range(6):
            begin_request(session, "bench", f"key {number}", "fingerprint")
        old = datetime.now(UTC) - timedelta(days=31)
        session.execute(update(RequestRow).where(RequestRow.id != 2).values(created_at=old))
    with catalogue.writing() as session:
        assert remove_old_requests(session, always_kept=6) == 0
        assert remove_old_requests(session, always_kept=2) == 3
        assert remove_old_requests(session, always_kept=2) == 0
        left = [number for number in range(6) if find_request(session, "bench", f"key {number}")]
    assert left == [1, 4, 5]
