"""Sequences under a name, to be run again and again."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.errors import NotFoundError
from store.models.service import SequenceDocumentRow


@dataclass(frozen=True)
class SequenceDocument:
    """A sequence as it was given; `changed_at` is UTC."""

    name: str
    document: dict[str, Any]
    changed_at: datetime


def save_sequence(session: Session, name: str, document: dict[str, Any]) -> SequenceDocument:
    """Keep a document under a name, in place of the one that was there.

    Raises:
        StoreError: it has no JSON form.
    """
    row = session.scalars(select(SequenceDocumentRow).filter_by(name=name)).one_or_none()
    now = datetime.now(UTC)
    if row is None:
        row = SequenceDocumentRow(name=name, document=document, changed_at=now)
        session.add(row)
    else:
        row.document, row.changed_at = document, now
    session.flush()
    return _document(row)


def get_sequence(session: Session, name: str) -> SequenceDocument:
    """One document.

    Raises:
        NotFoundError: nothing is kept under that name.
    """
    return _document(_row(session, name))


def list_sequences(session: Session, *, after: str = "", limit: int = 100) -> list[SequenceDocument]:
    """Documents by name; `after` a name, to go on with a list."""
    query = select(SequenceDocumentRow).where(SequenceDocumentRow.name > after)
    return [_document(row) for row in session.scalars(query.order_by(SequenceDocumentRow.name).limit(limit))]


def remove_sequence(session: Session, name: str) -> None:
    """Forget a document; runs keep their own copy.

    Raises:
        NotFoundError: nothing is kept under that name.
    """
    session.delete(_row(session, name))
    session.flush()


def _row(session: Session, name: str) -> SequenceDocumentRow:
    row = session.scalars(select(SequenceDocumentRow).filter_by(name=name)).one_or_none()
    if row is None:
        raise NotFoundError(f"there is no sequence {name!r}")
    return row


def _document(row: SequenceDocumentRow) -> SequenceDocument:
    return SequenceDocument(row.name, row.document, row.changed_at)
