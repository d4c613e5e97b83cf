"""The audit log: who asked for which action, and its outcome. Rows are never changed, and each is chained to the last.

What the chain proves, and what it does not: docs/decisions/0015-checksums-and-a-hash-chain.md.
"""

import math
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.database.checksums import LATER, WITH_ROW, chain_hash, hashed_values, stored_rows
from store.errors import StoreError
from store.models.base import Base
from store.models.rows import add_row, equal, from_row, newest_first
from store.models.service import AuditEntryRow, AuditHeadRow
from store.text import changed, without_halves
from store.version import software_version

_HEAD = 1  # number of the row


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
    """Store an action and return the number of the entry; StoreError where the details have no JSON form.

    An entry is kept also where somebody gave what cannot be stored: halves of surrogate pairs are replaced, and numbers
    that are not finite become text.
    """
    head = session.get(AuditHeadRow, _HEAD, with_for_update=True) or AuditHeadRow(id=_HEAD, entries=0, chain_hash="")
    row = AuditEntryRow(
        who=without_halves(who), action=without_halves(action), target=without_halves(target),
        outcome=without_halves(outcome), details=changed(details or {}, _storable),
        created_at=datetime.now(UTC), software_version=software_version(),
    )  # fmt: skip
    values = hashed_values(Base.metadata.tables[AuditEntryRow.__tablename__], lambda name: getattr(row, name))
    head.entries, head.chain_hash = head.entries + 1, chain_hash(WITH_ROW, head.chain_hash, values)
    row.chain_hash = head.chain_hash
    session.add(head)
    return add_row(session, row).id


def list_audit_entries(
    session: Session, *, action: str | None = None, before: int | None = None, limit: int = 100
) -> list[AuditEntry]:
    """Entries, newest first; a page begins before the number `before`."""
    query = select(AuditEntryRow).where(*equal(AuditEntryRow, action=action))
    rows = session.scalars(newest_first(query, AuditEntryRow.id, before, limit))
    return [from_row(AuditEntry, row, at=row.created_at, details=changed(row.details, without_halves)) for row in rows]


def _storable(value: Any) -> Any:
    return str(value) if isinstance(value, float) and not math.isfinite(value) else without_halves(value)


@dataclass(frozen=True)
class ChainedLog:
    """The audit log as its chain shows it.

    Attributes:
        entries: how many there are.
        head: hash of the last entry; empty where there is none.
        later: number of entries from before the log had a chain; they got their hashes at the upgrade.
        faults: of the chain; each names the entry.
        has_noted: whether an entry has the hash that was noted earlier.
    """

    entries: int
    head: str
    later: int
    faults: tuple[str, ...]
    has_noted: bool


def read_chain(session: Session, noted: str | None = None) -> ChainedLog:
    """Verify the chain of the audit log, and look for a hash; entries that are written meanwhile do not count."""
    head = session.get(AuditHeadRow, _HEAD)
    faults = list[str]()
    previous, entries, later, has_noted = "", 0, 0, False
    for keys, values in stored_rows(session.connection(), Base.metadata.tables[AuditEntryRow.__tablename__]):
        found = str(keys["chain_hash"])
        if found != chain_hash(found[:1], previous, values):
            faults.append(f"entry {keys['id']} was changed, or those before it were changed, removed or put elsewhere")
        later += found.startswith(LATER)
        has_noted = has_noted or found == noted
        entries += 1
        previous = found
    known = (0, "") if head is None else (head.entries, head.chain_hash)
    if known != (entries, previous):
        faults.append(f"{known[0]} entries were written, {entries} are there, or the last one is another")
    return ChainedLog(entries, previous, later, tuple(faults), has_noted)


def check_head(log: ChainedLog, head: str) -> None:
    """Check that a log, read with the hash `head` that was noted earlier, has its entry; StoreError where not."""
    if not log.has_noted:
        raise StoreError(f"no entry of the audit log has the hash {head}: entries were rewritten since it was noted")
