"""Runs: what was measured or imported, when, with which setup, and how it ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import Any
from uuid import uuid4

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from store.errors import NotFoundError, StoreError
from store.instruments import Instrument, StoredChannel, add_channels, calibration_id
from store.models.measurements import RunEventRow, RunInstrumentRow, RunRow, SpecimenRow
from store.provenance import configuration_hash
from store.states import RunState
from store.waveforms import SUFFIX


@dataclass(frozen=True)
class Run:
    """One run as the catalogue has it.

    Attributes:
        kind: hammer, sweep, import, ...
        article: the test article that was measured; its joints are the specimens.
        reason: why it was stopped or failed, lately; `list_run_events` has the older reasons too.
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


@dataclass(frozen=True)
class RunEvent:
    """A run came into `state`: it was started, ended or resumed.

    Attributes:
        reason: why, where that was said.
        who: did it: person, computer and process.
        happened_at: UTC.
    """

    state: RunState
    reason: str | None
    who: str | None
    happened_at: datetime


def start_run(
    session: Session,
    *,
    kind: str,
    title: str,
    article: str,
    setup: dict[str, Any],
    sequence: dict[str, Any] | None = None,
    channels: Sequence[StoredChannel] = (),
    instruments: Sequence[Instrument] = (),
    started_at: datetime | None = None,
    who: str | None = None,
    reason: str | None = None,
) -> Run:
    """Begin a run now, or at `started_at` (UTC), and note who did, and why where there is something to say.

    Raises:
        StoreError: setup or sequence have no JSON form, or a channel's name comes twice.
    """
    row = _new_row(session, kind, RunState.RUNNING, title, article, setup, sequence or {}, started_at)
    _add_instruments(session, row, channels, instruments)
    _note(session, row, reason, who, row.started_at)
    return _run(row)


def create_run(
    session: Session,
    *,
    kind: str,
    title: str,
    article: str,
    setup: dict[str, Any],
    sequence: dict[str, Any],
    who: str | None = None,
) -> Run:
    """Store what is to be measured; `begin_run` begins it. Until then its start is when it was created.

    Raises:
        StoreError: setup or sequence have no JSON form.
    """
    row = _new_row(session, kind, RunState.CREATED, title, article, setup, sequence, None)
    _add_instruments(session, row, (), ())
    _note(session, row, None, who, row.started_at)
    return _run(row)


def begin_run(
    session: Session,
    run_id: int,
    *,
    sequence: dict[str, Any],
    channels: Sequence[StoredChannel] = (),
    instruments: Sequence[Instrument] = (),
    who: str | None = None,
    reason: str | None = None,
) -> Run:
    """Begin a run now that was created; with its sequence as it is carried out, seeds drawn.

    Raises:
        NotFoundError: there is no such run.
        StoreError: it was begun before, or a channel's name comes twice.
    """
    row = _row(session, run_id)
    if row.state != RunState.CREATED:
        raise StoreError(f"run {run_id} was begun before; it is {row.state}")
    row.state, row.sequence, row.started_at = RunState.RUNNING, sequence, datetime.now(UTC)
    _add_instruments(session, row, channels, instruments)
    _note(session, row, reason, who, row.started_at)
    return _run(row)


def finish_run(
    session: Session,
    run_id: int,
    state: RunState,
    reason: str | None = None,
    finished_at: datetime | None = None,
    who: str | None = None,
) -> Run:
    """End a run now, or at `finished_at` (UTC), and note who did.

    A clock that was set back meanwhile does not keep a run from ending: the reason says so.

    Raises:
        NotFoundError: there is no such run.
        StoreError: the run has ended already, `state` is no end, a stopped or failed run has no reason, or
            `finished_at` is given and before its start.
    """
    row = _row(session, run_id)
    if row.state != RunState.RUNNING:
        raise StoreError(f"run {run_id} is {row.state} already")
    if state is RunState.RUNNING:
        raise StoreError(f"run {run_id} cannot end as {state}; give finished, stopped or failed")
    if state is not RunState.FINISHED and not reason:
        raise StoreError(f"run {run_id} is {state}: say why")
    ended = finished_at or datetime.now(UTC)
    if ended < row.started_at:
        if finished_at is not None:
            raise StoreError(f"run {run_id} cannot end at {ended}, before its start at {row.started_at}")
        back = f"the computer's clock was set back during the run, by at least {row.started_at - ended}"
        reason = f"{reason}; {back}" if reason else back
    row.state, row.reason, row.finished_at = state, reason, ended
    _note(session, row, reason, who, ended)
    return _run(row)


def reopen_run(session: Session, run_id: int, reason: str, who: str | None = None) -> Run:
    """Let a run that was stopped, failed or cut off go on; how it ended stays among its events.

    Raises:
        NotFoundError: there is no such run.
        StoreError: the run is finished.
    """
    row = _row(session, run_id)
    if row.state == RunState.FINISHED:
        raise StoreError(f"run {run_id} is finished; nothing of it is left to do")
    row.state, row.reason, row.finished_at = RunState.RUNNING, None, None
    _note(session, row, reason, who, datetime.now(UTC))
    return _run(row)


def list_run_events(session: Session, run_id: int) -> list[RunEvent]:
    """The history of a run, oldest first; it begins with its start.

    Raises:
        NotFoundError: there is no such run.
    """
    _row(session, run_id)
    rows = session.scalars(select(RunEventRow).filter_by(run_id=run_id).order_by(RunEventRow.id))
    return [RunEvent(RunState(row.state), row.reason, row.who, row.happened_at) for row in rows]


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
    before: int | None = None,
) -> list[Run]:
    """Runs, last stored first whatever the clock said, optionally of one kind, state or article.

    `before` is the number of a run, to go on with a list without counting what is skipped.
    """
    query = select(RunRow).filter_by(**_wanted(kind, state, article)).order_by(RunRow.id.desc())
    if before is not None:
        query = query.where(RunRow.id < before)
    return [_run(row) for row in session.scalars(query.limit(limit).offset(offset))]


def count_runs(
    session: Session, *, kind: str | None = None, state: RunState | None = None, article: str | None = None
) -> int:
    """How many runs there are, optionally of one kind, state or article."""
    query = select(func.count()).select_from(RunRow).filter_by(**_wanted(kind, state, article))
    return session.scalar(query) or 0


def specimen_id(session: Session, article: str, name: str) -> int:
    """Number of the specimen: the cylinders of joint `name` of an article; the row is made where it is new."""
    known = session.scalars(select(SpecimenRow.id).filter_by(article=article, name=name)).one_or_none()
    if known is not None:
        return known
    row = SpecimenRow(article=article, name=name)
    session.add(row)
    session.flush()
    return row.id


def _new_row(
    session: Session,
    kind: str,
    state: RunState,
    title: str,
    article: str,
    setup: dict[str, Any],
    sequence: dict[str, Any],
    started_at: datetime | None,
) -> RunRow:
    started_at = started_at or datetime.now(UTC)
    row = RunRow(
        kind=kind,
        state=state,
        title=title,
        article=article,
        started_at=started_at,
        setup=setup,
        sequence=sequence,
        configuration_hash="",
        waveform_file=f"{started_at:%Y%m%d}-{uuid4().hex[:12]}{SUFFIX}",
    )
    session.add(row)
    session.flush()
    return row


def _add_instruments(
    session: Session, row: RunRow, channels: Sequence[StoredChannel], instruments: Sequence[Instrument]
) -> None:
    """Connect a run with what it is measured with; the hash of its configuration follows."""
    configuration = {
        "setup": row.setup,
        "sequence": row.sequence,
        "channels": [_plain(channel) for channel in channels],
        "instruments": [_plain(instrument) for instrument in instruments],
    }
    row.configuration_hash = configuration_hash(configuration)
    add_channels(session, row.id, tuple(channels))
    calibrations = {calibration_id(session, instrument) for instrument in instruments}
    session.add_all(RunInstrumentRow(run_id=row.id, calibration_id=number) for number in sorted(calibrations))


def _note(session: Session, row: RunRow, reason: str | None, who: str | None, happened_at: datetime) -> None:
    session.add(RunEventRow(run_id=row.id, state=row.state, reason=reason, who=who, happened_at=happened_at))
    session.flush()


def _wanted(kind: str | None, state: RunState | None, article: str | None) -> dict[str, str]:
    wanted = {"kind": kind, "state": state, "article": article}
    return {name: value for name, value in wanted.items() if value is not None}


def _plain(value: StoredChannel | Instrument) -> dict[str, Any]:
    # Dates have no JSON form.
    plain = asdict(value)
    holder = plain.get("instrument", plain)
    if holder["calibrated_on"] is not None:
        holder["calibrated_on"] = holder["calibrated_on"].isoformat()
    return plain


def _row(session: Session, run_id: int) -> RunRow:
    row = session.get(RunRow, run_id)
    if row is None:
        raise NotFoundError(f"there is no run {run_id}")
    return row


def _run(row: RunRow) -> Run:
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
