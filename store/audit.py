"""The audit log: who asked for what, and what came of it. Rows are never changed."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.models.service import AuditEntryRow


@dataclass(frozen=True)
class AuditEntry:
    """One deed, or its beginning.

    Attributes:
        who: the key's number and name, or where the caller sat.
        action: such as "start run".
        target: what it was done to, such as "run 7".
        outcome: "begun" (what came of it is an entry of its own), "done", "refused: " and why, or why it failed.
        details: what else was given; `begun` is the number of the entry of its beginning.
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
    """Note a deed; the number of the entry.

    Raises:
        StoreError: the details have no JSON form.
    """
    row = AuditEntryRow(who=who, action=action, target=target, outcome=outcome, details=details or {})
    session.add(row)
    session.flush()
    return row.id


def list_audit_entries(
    session: Session, *, action: str | None = None, before: int | None = None, limit: int = 100
) -> list[AuditEntry]:
    """Deeds, newest first; `before` a number, to go on with a list."""
    query = select(AuditEntryRow).order_by(AuditEntryRow.id.desc()).limit(limit)
    if action is not None:
        query = query.filter_by(action=action)
    if before is not None:
        query = query.where(AuditEntryRow.id < before)
    return [
        AuditEntry(row.id, row.created_at, row.who, row.action, row.target, row.outcome, row.details)
        for row in session.scalars(query)
    ]
