"""Runs: what was measured or imported, when, with which setup, and how it ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any
from uuid import uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session

from store import models
from store.errors import NotFoundError, StoreError
from store.instruments import Channel, Instrument, add_channels, calibration_id
from store.provenance import configuration_hash
from store.waveforms import SUFFIX


class RunState(StrEnum):
    """Where a run stands; finished, stopped and failed are for good."""

    RUNNING = "running"
    FINISHED = "finished"
    STOPPED = "stopped"
    FAILED = "failed"


@dataclass(frozen=True)
class Run:
    """One run as the catalogue has it.

    Attributes:
        kind: hammer, sweep, import, ...
        article: the test article that was measured; its joints are the specimens.
        reason: why it was stopped or failed.
        setup: what was built and how it was measured, in the form of a bundle's setup.json.
        sequence: what was asked for.
        configuration_hash: SHA-256 over setup, sequence, channels and instruments.
        waveform_file: name of its file in the folder of waveforms.
    """

    id: int
    kind: str
    state: RunState
    title: str
    article: str
    started_at: datetime
    finished_at: datetime | None
    reason: str | None
    setup: dict[str, Any]
    sequence: dict[str, Any]
    configuration_hash: str
    waveform_file: str
    software_version: str


def start_run(
    session: Session,
    *,
    kind: str,
    title: str,
    article: str,
    setup: dict[str, Any],
    sequence: dict[str, Any] | None = None,
    channels: Sequence[Channel] = (),
    instruments: Sequence[Instrument] = (),
    started_at: datetime | None = None,
) -> Run:
    """Begin a run now, or at `started_at` (UTC).

    Raises:
        StoreError: setup or sequence have no JSON form, or a channel's name comes twice.
    """
    started_at = started_at or datetime.now(UTC)
    configuration = {
        "setup": setup,
        "sequence": sequence or {},
        "channels": [_plain(channel) for channel in channels],
        "instruments": [_plain(instrument) for instrument in instruments],
    }
    row = models.Run(
        kind=kind,
        state=RunState.RUNNING,
        title=title,
        article=article,
        started_at=started_at,
        setup=setup,
        sequence=sequence or {},
        configuration_hash=configuration_hash(configuration),
        waveform_file=f"{started_at:%Y%m%d}-{uuid4().hex[:12]}{SUFFIX}",
    )
    session.add(row)
    session.flush()
    add_channels(session, row.id, tuple(channels))
    calibrations = {calibration_id(session, instrument) for instrument in instruments}
    session.add_all(models.RunInstrument(run_id=row.id, calibration_id=number) for number in sorted(calibrations))
    session.flush()
    return _run(row)


def finish_run(
    session: Session,
    run_id: int,
    state: RunState,
    reason: str | None = None,
    finished_at: datetime | None = None,
) -> Run:
    """End a run now, or at `finished_at` (UTC).

    Raises:
        NotFoundError: there is no such run.
        StoreError: the run has ended already, `state` is no end, or a stopped or failed run has no reason.
    """
    row = _row(session, run_id)
    if row.state != RunState.RUNNING:
        raise StoreError(f"run {run_id} is {row.state} already")
    if state is RunState.RUNNING:
        raise StoreError(f"run {run_id} cannot end as {state}; give finished, stopped or failed")
    if state is not RunState.FINISHED and not reason:
        raise StoreError(f"run {run_id} is {state}: say why")
    row.state, row.reason, row.finished_at = state, reason, finished_at or datetime.now(UTC)
    session.flush()
    return _run(row)


def get_run(session: Session, run_id: int) -> Run:
    """One run.

    Raises:
        NotFoundError: there is no such run.
    """
    return _run(_row(session, run_id))


def list_runs(
    session: Session,
    *,
    kind: str | None = None,
    state: RunState | None = None,
    article: str | None = None,
    limit: int = 100,
    offset: int = 0,
) -> list[Run]:
    """Runs, newest first, optionally of one kind, state or article."""
    query = select(models.Run).order_by(models.Run.started_at.desc(), models.Run.id.desc())
    wanted = {"kind": kind, "state": state, "article": article}
    query = query.filter_by(**{name: value for name, value in wanted.items() if value is not None})
    return [_run(row) for row in session.scalars(query.limit(limit).offset(offset))]


def specimen_id(session: Session, article: str, name: str) -> int:
    """Number of the specimen: the cylinders of joint `name` of an article; the row is made where it is new."""
    known = session.scalars(select(models.Specimen.id).filter_by(article=article, name=name)).one_or_none()
    if known is not None:
        return known
    row = models.Specimen(article=article, name=name)
    session.add(row)
    session.flush()
    return row.id


def _plain(value: Channel | Instrument) -> dict[str, Any]:
    # Dates have no JSON form.
    plain = asdict(value)
    holder = plain.get("instrument", plain)
    if holder["calibrated_on"] is not None:
        holder["calibrated_on"] = holder["calibrated_on"].isoformat()
    return plain


def _row(session: Session, run_id: int) -> models.Run:
    row = session.get(models.Run, run_id)
    if row is None:
        raise NotFoundError(f"there is no run {run_id}")
    return row


def _run(row: models.Run) -> Run:
    return Run(
        id=row.id,
        kind=row.kind,
        state=RunState(row.state),
        title=row.title,
        article=row.article,
        started_at=row.started_at,
        finished_at=row.finished_at,
        reason=row.reason,
        setup=row.setup,
        sequence=row.sequence,
        configuration_hash=row.configuration_hash,
        waveform_file=row.waveform_file,
        software_version=row.software_version,
    )
