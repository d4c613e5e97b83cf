"""Commissioning records: every examination of a rig, never changed; the newest one is what a run is compared with."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.models.measurements import CommissioningRecordRow
from store.models.rows import add_row, equal, from_row, get_row, newest_first
from store.service.audit import add_audit_entry
from store.states import Verdict


@dataclass(frozen=True)
class CommissioningRecord:
    """One examination of a rig.

    Attributes:
        place: where the sensors were: bench, calibrator or mass.
        who: answers for it.
        verdict: of its checks.
        checks: each with id, subject, state, measured, limit, unit and advice.
        instruments: each with kind, model, serial, and of sensors the sensitivity in the channel table.
        created_at: when, UTC.
        checksum: over all of it, as the audit log has it, too.
    """

    id: int
    rig: str
    place: str
    who: str
    verdict: Verdict
    checks: tuple[dict[str, Any], ...]
    instruments: tuple[dict[str, Any], ...]
    created_at: datetime
    checksum: str


def add_commissioning_record(
    session: Session,
    *,
    rig: str,
    place: str,
    who: str,
    verdict: Verdict,
    checks: Sequence[dict[str, Any]],
    instruments: Sequence[dict[str, Any]],
) -> CommissioningRecord:
    """Store an examination, and sign it by an entry of the audit log with the checksum of its row."""
    row = CommissioningRecordRow(
        rig=rig, place=place, who=who, verdict=verdict.value,
        checks={"checks": list(checks)}, instruments={"instruments": list(instruments)},
    )  # fmt: skip
    stored = _record(add_row(session, row))
    signed = {"verdict": verdict.value, "checksum": stored.checksum}
    target = f"commissioning record {stored.id}"
    add_audit_entry(session, who=who, action="sign commissioning", target=target, outcome="done", details=signed)
    return stored


def get_commissioning_record(session: Session, number: int) -> CommissioningRecord:
    """One record, or NotFoundError."""
    return _record(get_row(session, CommissioningRecordRow, number, "commissioning record"))


def list_commissioning_records(
    session: Session, *, rig: str | None = None, place: str | None = None, before: int | None = None, limit: int = 100
) -> list[CommissioningRecord]:
    """Records, newest first; a page begins before the number `before`."""
    query = select(CommissioningRecordRow).where(*equal(CommissioningRecordRow, rig=rig, place=place))
    rows = session.scalars(newest_first(query, CommissioningRecordRow.id, before, limit))
    return [_record(row) for row in rows]


def _record(row: CommissioningRecordRow) -> CommissioningRecord:
    return from_row(
        CommissioningRecord,
        row,
        verdict=Verdict(row.verdict),
        checks=tuple(row.checks["checks"]),
        instruments=tuple(row.instruments["instruments"]),
    )
