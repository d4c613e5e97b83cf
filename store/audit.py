"""The audit log: who asked for which action, and its outcome. Rows are never changed."""

from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.models.service import AuditEntryRow
from store.rows import add_row, equal, from_row, newest_first


@dataclass(frozen=True)
class AuditEntry:
    """One action, or its beginning.

    Attributes:
        who: number and name of the key, or the place of the caller.
        action: such as "start run".
        target: its object, such as "run 7".
        outcome: "begun" (an entry of its own follows with the outcome), "done", "refused: " and why, or why it failed.
        details: further values; `begun` is the number of the entry of its beginning.
    """

    id: int
    at: datetime
    who: str
    action: str
    target: str
    outcome: str
    details: dict[str, Any]


def add_audit_entry(
    session: Session, *, who: str, action: str, target: str, outcome: str, details: dict[str, Any] | None = None
) -> int:
    """Store an action and return the number of the entry; StoreError where the details have no JSON form."""
    row = AuditEntryRow(who=who, action=action, target=target, outcome=outcome, details=details or {})
    return add_row(session, row).id


def list_audit_entries(
    session: Session, *, action: str | None = None, before: int | None = None, limit: int = 100
) -> list[AuditEntry]:
    """Entries, newest first; a page begins before the number `before`."""
    query = select(AuditEntryRow).where(*equal(AuditEntryRow, action=action))
    rows = session.scalars(newest_first(query, AuditEntryRow.id, before, limit))
    return [from_row(AuditEntry, row, at=row.created_at) for row in rows]
