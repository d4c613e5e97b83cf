"""Named sequences, to be run again and again."""

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import literal, select, union
from sqlalchemy.orm import Session

from store.errors import NotFoundError
from store.models.rows import add_row, from_row
from store.models.service import SequenceDocumentRow


@dataclass(frozen=True)
class SequenceDocument:
    """A sequence as it was given; `changed_at` is UTC."""

    name: str
    document: dict[str, Any]
    changed_at: datetime


def save_sequence_document(session: Session, name: str, document: dict[str, Any]) -> SequenceDocument:
    """Store a document under a name, in place of an older one; StoreError where it has no JSON form."""
    row = _find(session, name) or SequenceDocumentRow(name=name)
    row.document, row.changed_at = document, datetime.now(UTC)
    return from_row(SequenceDocument, add_row(session, row))


def lock_sequence(session: Session, name: str) -> None:
    """Let nobody else change the document, if there is one, until this transaction ends."""
    session.scalars(select(SequenceDocumentRow).filter_by(name=name).with_for_update()).one_or_none()


def get_sequence(session: Session, name: str) -> SequenceDocument:
    """One document, or NotFoundError."""
    return from_row(SequenceDocument, _row(session, name))


def list_with_names(
    session: Session, others: Iterable[str], *, after: str = "", limit: int = 100
) -> list[tuple[str, SequenceDocument | None]]:
    """Names of documents and `others`, each once, in the order of names in this database, with the documents."""
    name = SequenceDocumentRow.name
    names = union(select(name), *(select(literal(other, name.type)) for other in others)).subquery()
    query = select(names.c.name, SequenceDocumentRow).outerjoin(SequenceDocumentRow, name == names.c.name)
    rows = session.execute(query.where(names.c.name > after).order_by(names.c.name).limit(limit))
    return [(found, None if row is None else from_row(SequenceDocument, row)) for found, row in rows]


def remove_sequence_document(session: Session, name: str) -> None:
    """Remove a document, or NotFoundError; runs have their own copy."""
    session.delete(_row(session, name))
    session.flush()


def _find(session: Session, name: str) -> SequenceDocumentRow | None:
    return session.scalars(select(SequenceDocumentRow).filter_by(name=name)).one_or_none()


def _row(session: Session, name: str) -> SequenceDocumentRow:
    row = _find(session, name)
    if row is None:
        raise NotFoundError(f"there is no sequence {name!r}")
    return row
