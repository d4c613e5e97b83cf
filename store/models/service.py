"""Tables of the service: keys, audit log, requests, sequences, limits, jobs, diagnoses, spools, alarms."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from store.models.base import Base, Recorded


class ApiKeyRow(Recorded, Base):
    """A key that identifies a person or a program; only a hash of its secret is stored."""

    __tablename__ = "api_keys"

    name: Mapped[str]
    digest: Mapped[str] = mapped_column(unique=True)
    scopes: Mapped[list[str]]
    expires_at: Mapped[datetime | None]
    revoked_at: Mapped[datetime | None]


class PageSessionRow(Recorded, Base):
    """A session of the page for a key; only a hash of its secret is stored."""

    __tablename__ = "page_sessions"

    digest: Mapped[str] = mapped_column(unique=True)
    key_id: Mapped[int] = mapped_column(ForeignKey("api_keys.id"))
    ends_at: Mapped[datetime]


class AuditEntryRow(Recorded, Base):
    """An action that was asked for, and its outcome; never changed. Each has the hash of itself and the last."""

    __tablename__ = "audit_entries"
    __table_args__ = (Index(None, "action", "id"),)

    who: Mapped[str]
    action: Mapped[str]
    target: Mapped[str]
    outcome: Mapped[str]
    details: Mapped[dict[str, Any]]
    chain_hash: Mapped[str] = mapped_column(server_default="", sort_order=2)


class AuditHeadRow(Base):
    """The one row with the number of audit entries and the hash of the last one; who adds an entry locks it."""

    __tablename__ = "audit_head"

    id: Mapped[int] = mapped_column(primary_key=True)
    entries: Mapped[int]
    chain_hash: Mapped[str]


class RequestRow(Recorded, Base):
    """A request with an idempotency key: sent again, it gets the first answer."""

    __tablename__ = "requests"
    __table_args__ = (UniqueConstraint("who", "idempotency_key"),)

    who: Mapped[str]
    idempotency_key: Mapped[str]
    fingerprint: Mapped[str]
    status: Mapped[int | None]
    body: Mapped[str | None]


class SequenceDocumentRow(Recorded, Base):
    """A named sequence, to be run again and again."""

    __tablename__ = "sequence_documents"

    name: Mapped[str] = mapped_column(unique=True)
    document: Mapped[dict[str, Any]]
    changed_at: Mapped[datetime]


class RigLimitsRow(Recorded, Base):
    """The limits of a rig, and who set them; the newest row of a rig is in force, and no row is ever changed."""

    __tablename__ = "rig_limits"
    __table_args__ = (Index(None, "rig", "id"),)

    rig: Mapped[str]
    who: Mapped[str]
    limits: Mapped[dict[str, Any]]


class JobRow(Recorded, Base):
    """Longer work; the worker with `lease_token` does it until `leased_until`."""

    __tablename__ = "jobs"
    __table_args__ = (Index(None, "state", "id"), Index(None, "kind", "id"))

    kind: Mapped[str]
    state: Mapped[str]
    parameters: Mapped[dict[str, Any]]
    asked_by: Mapped[str]
    attempts: Mapped[int]
    cancelled: Mapped[bool]
    lease_token: Mapped[str | None]
    leased_until: Mapped[datetime | None]
    heartbeat_at: Mapped[datetime | None]
    stage: Mapped[str | None]
    done: Mapped[int]
    total: Mapped[int]
    now: Mapped[str | None]
    result: Mapped[dict[str, Any] | None]
    error: Mapped[str | None]
    started_at: Mapped[datetime | None]
    finished_at: Mapped[datetime | None]


class DiagnosisRow(Recorded, Base):
    """A diagnosis of the gap between measurement and simulation: its verdict and the whole document."""

    __tablename__ = "diagnoses"

    analysis_id: Mapped[int] = mapped_column(ForeignKey("analyses.id"), unique=True)
    status: Mapped[str]
    effects: Mapped[list[str]]
    gap_before_percent: Mapped[float | None]
    gap_after_percent: Mapped[float | None]
    document: Mapped[dict[str, Any]]


class SpoolRow(Recorded, Base):
    """How far a spool is stored; its name begins with that of the waveform file of its run."""

    __tablename__ = "spools"

    name: Mapped[str] = mapped_column(unique=True)
    last_stored: Mapped[int]


class AlarmRow(Recorded, Base):
    """Something that somebody has to be told of, until a person acknowledges it; a cause raises one alarm."""

    __tablename__ = "alarms"
    __table_args__ = (Index(None, "rig", "acknowledged_at", "id"),)

    uid: Mapped[str] = mapped_column(unique=True)
    cause: Mapped[str] = mapped_column(unique=True)
    kind: Mapped[str]
    rig: Mapped[str]
    run_id: Mapped[int | None] = mapped_column(ForeignKey("runs.id"))
    text: Mapped[str]
    happened_at: Mapped[datetime]
    acknowledged_at: Mapped[datetime | None]
    acknowledged_by: Mapped[str | None]
    note: Mapped[str | None]


class AlarmDeliveryRow(Recorded, Base):
    """A message to one channel about an alarm: exactly what is sent, and what came of the last attempt."""

    __tablename__ = "alarm_deliveries"
    __table_args__ = (UniqueConstraint("alarm_id", "channel"),)

    alarm_id: Mapped[int] = mapped_column(ForeignKey("alarms.id"))
    channel: Mapped[str]
    body: Mapped[str]
    attempts: Mapped[int]
    tried_at: Mapped[datetime | None]
    next_at: Mapped[datetime]
    result: Mapped[str | None]
    delivered_at: Mapped[datetime | None]
