"""Requests that act, by idempotency key: one that is sent again gets the first answer, and nothing is done twice."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from store.models.service import RequestRow


@dataclass(frozen=True)
class Answered:
    """What is known of an earlier request with the same key.

    Attributes:
        fingerprint: of what was asked for.
        status: HTTP status of the answer; None while it is not there.
        body: of the answer.
    """

    fingerprint: str
    status: int | None
    body: str | None


def find_request(session: Session, who: str, key: str) -> Answered | None:
    """What is known of the request that `who` sent with this key; None where there was none."""
    row = session.scalars(select(RequestRow).filter_by(who=who, idempotency_key=key)).one_or_none()
    return None if row is None else Answered(row.fingerprint, row.status, row.body)


def begin_request(session: Session, who: str, key: str, fingerprint: str) -> Answered | None:
    """Note that a request begins; where `who` has used the key before, change nothing and say what is known of it."""
    before = find_request(session, who, key)
    if before is not None:
        return before
    session.add(RequestRow(who=who, idempotency_key=key, fingerprint=fingerprint))
    session.flush()
    return None


def answer_request(session: Session, who: str, key: str, status: int, body: str) -> None:
    """Keep the answer of a request."""
    row = session.scalars(select(RequestRow).filter_by(who=who, idempotency_key=key)).one()
    row.status, row.body = status, body


def forget_request(session: Session, who: str, key: str) -> None:
    """Forget a request that did nothing: it may be sent again."""
    session.execute(delete(RequestRow).filter_by(who=who, idempotency_key=key))
