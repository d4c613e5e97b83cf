"""Requests by idempotency key: a request that is sent again gets the first answer, and nothing is done twice."""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from sqlalchemy import Select, delete, select
from sqlalchemy.orm import Session

from store.models.rows import found_or_added, from_row
from store.models.service import RequestRow

KEPT = timedelta(days=30)
ALWAYS_KEPT = 10_000
"""Newest requests that stay whatever the clock says: one that is set forwards makes none of them old."""


@dataclass(frozen=True)
class Answered:
    """An earlier request with the same key.

    Attributes:
        fingerprint: of the request.
        status: HTTP status of the answer; None until there is one.
        body: of the answer.
    """

    fingerprint: str
    status: int | None
    body: str | None


def find_request(session: Session, who: str, key: str) -> Answered | None:
    """The request that `who` sent with this key; None if there was none."""
    row = session.scalars(_named(who, key)).one_or_none()
    return None if row is None else from_row(Answered, row)


def begin_request(session: Session, who: str, key: str, fingerprint: str) -> Answered | None:
    """Store that a request begins; where `who` has used the key before, return that request and change nothing."""
    row, is_new = found_or_added(
        session, _named(who, key), lambda: RequestRow(who=who, idempotency_key=key, fingerprint=fingerprint)
    )
    return None if is_new else from_row(Answered, row)


def answer_request(session: Session, who: str, key: str, status: int, body: str) -> None:
    """Store the answer of a request."""
    row = session.scalars(_named(who, key)).one()
    row.status, row.body = status, body


def forget_request(session: Session, who: str, key: str) -> None:
    """Remove a request that did nothing: it may be sent again."""
    session.execute(delete(RequestRow).filter_by(who=who, idempotency_key=key))


def remove_old_requests(session: Session, kept: timedelta = KEPT, always_kept: int = ALWAYS_KEPT) -> int:
    """Remove requests that are older than `kept` and not among the newest `always_kept`; how many."""
    newest = select(RequestRow.id).order_by(RequestRow.id.desc()).offset(always_kept).limit(1)
    last = session.scalars(newest).one_or_none()
    if last is None:
        return 0
    old = delete(RequestRow).where(RequestRow.id <= last, RequestRow.created_at < datetime.now(UTC) - kept)
    return len(session.scalars(old.returning(RequestRow.id)).all())


def _named(who: str, key: str) -> Select[RequestRow]:
    return select(RequestRow).filter_by(who=who, idempotency_key=key)
