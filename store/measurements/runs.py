"""Runs: measurements and imports, with their setup, their times, and how they ended."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, date, datetime, time, timedelta, tzinfo
from typing import Any
from uuid import uuid4

from sqlalchemy import func, select
from sqlalchemy.orm import Session, load_only, selectinload

from store.errors import StoreError, WrongRigError
from store.instrument import Instrument, StoredChannel
from store.measurements.amendments import AS_MEASURED
from store.measurements.instruments import add_channels, calibration_id
from store.measurements.specimens import runs_with_specimen
from store.models.measurements import RunEventRow, RunInstrumentRow, RunRow
from store.models.rows import add_row, equal, from_row, get_row, newest_first
from store.provenance import configuration_hash
from store.states import RunState
from store.waveforms.folder import SUFFIX

_FIRST, _LAST = datetime(1, 1, 2, tzinfo=UTC), datetime(9999, 12, 30, tzinfo=UTC)
_LATELY = 1000
"""Number of the newest changes of all rigs that are searched first for the last change of one rig."""


@dataclass(frozen=True)
class Run:
    """One run.

    Attributes:
        kind: sequence (measured here) or import.
        article: the test article; its joints are the specimens.
        started_at, finished_at: UTC.
        reason: why it was stopped or failed the last time, or what was left out of it where it is finished;
            `list_run_events` has the older reasons too.
        setup: the article and how it was measured, in the form of a bundle's setup.json, as it was amended last.
        setup_version: 1 as measured, one more with each amendment.
        sequence: the sequence that was asked for.
        configuration_hash: SHA-256 over the setup as measured, sequence, channels and instruments.
        waveform_file: name of its file in the folder of waveforms.
        rig: on which it is measured; None where it was not measured on a rig here, such as an import.
        automatic: whether a program does in it what operators do; None where nobody has said so.
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
    setup_version: int
    sequence: dict[str, Any]
    configuration_hash: str
    waveform_file: str
    software_version: str
    rig: str | None
    automatic: bool | None

    @property
    def began_at(self) -> datetime | None:
        """UTC of its start; None where it has not begun, and `started_at` is when it was planned."""
        return None if self.state is RunState.CREATED else self.started_at


@dataclass(frozen=True)
class RunEvent:
    """A change of a run's state: its start, an end, a resumption.

    Attributes:
        state: the new state.
        reason: why, if it was given.
        who: person, computer and process; None where it ended without the request of a person.
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
    state: RunState = RunState.RUNNING,
    provisional: bool = False,
    rig: str | None = None,
) -> Run:
    """Store a run and begin it now, or at `started_at` (UTC); note who did it.

    With the state `CREATED`, `begin_run` begins it later; until then it has the time of its creation as its start. A
    `provisional` run has no history before it begins, and `discard_run` may remove it.

    Raises StoreError if setup or sequence have no JSON form, or two channels have the same name.
    """
    started_at = started_at or datetime.now(UTC)
    row = RunRow(
        kind=kind,
        state=state,
        title=title,
        article=article,
        started_at=started_at,
        setup=setup,
        sequence=sequence or {},
        configuration_hash="",
        waveform_file=f"{started_at:%Y%m%d}-{uuid4().hex[:12]}{SUFFIX}",
        rig=rig,
    )
    add_row(session, row)
    return _run(row) if provisional else _connect(session, row, channels, instruments, None, who)


def check_rig(run: Run, rig: str) -> None:
    """Let a run pass that belongs to `rig`; WrongRigError where it belongs to another."""
    if run.rig != rig:
        owner = "no rig" if run.rig is None else f"rig {run.rig!r}"
        raise WrongRigError(f"run {run.id} belongs to {owner}, this is {rig!r}; resume it there, or begin a new run")


def begin_run(
    session: Session,
    run_id: int,
    *,
    sequence: dict[str, Any],
    channels: Sequence[StoredChannel] = (),
    instruments: Sequence[Instrument] = (),
    started_at: datetime | None = None,
    who: str | None = None,
    reason: str | None = None,
) -> Run:
    """Begin a created run now, or at `started_at` (UTC), with the sequence as it is carried out (its seed drawn).

    Raises NotFoundError if there is no such run; StoreError if it was begun before, or two channels have the same name.
    """
    row = _row(session, run_id, for_update=True)  # another program may end or begin it in this moment
    if row.state != RunState.CREATED:
        raise StoreError(f"run {run_id} was begun before; it is {row.state}")
    row.state, row.sequence, row.started_at = RunState.RUNNING, sequence, started_at or datetime.now(UTC)
    return _connect(session, row, channels, instruments, reason, who)


def finish_run(
    session: Session,
    run_id: int,
    state: RunState,
    reason: str | None = None,
    finished_at: datetime | None = None,
    who: str | None = None,
) -> Run:
    """End a run now, or at `finished_at` (UTC), and note who did it.

    A clock that was set back meanwhile does not keep a run from ending; the reason then says so. Raises NotFoundError
    if there is no such run; StoreError if the run has ended already, `state` is no end, a stopped or failed run has no
    reason, or `finished_at` is given and before its start.
    """
    row = _row(session, run_id, for_update=True)  # another program may end or begin it in this moment
    if row.state != RunState.RUNNING:
        raise StoreError(f"run {run_id} is {row.state} already")
    if state in (RunState.CREATED, RunState.RUNNING):
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
    return _note(session, row, reason, who, ended)


def note_automatic(session: Session, run_id: int, automatic: bool) -> None:
    """Note whether a program does in a run what operators do. Raises NotFoundError if there is no such run."""
    _row(session, run_id).automatic = automatic


def discard_run(session: Session, run_id: int) -> None:
    """Remove a provisional run that did not begin. Raises NotFoundError, StoreError where it has a history."""
    if list_run_events(session, run_id):
        raise StoreError(f"run {run_id} has a history; only a run that was not begun can be removed")
    session.delete(_row(session, run_id))


def reopen_run(session: Session, run_id: int, reason: str, who: str | None = None, at: datetime | None = None) -> Run:
    """Let a stopped, failed or interrupted run go on, now or since `at` (UTC); its earlier end stays in its history.

    Raises NotFoundError if there is no such run, StoreError if the run is finished.
    """
    row = _row(session, run_id, for_update=True)  # another program may end or begin it in this moment
    if row.state == RunState.FINISHED:
        raise StoreError(f"run {run_id} is finished; nothing of it is left to do")
    row.state, row.reason, row.finished_at = RunState.RUNNING, None, None
    return _note(session, row, reason, who, at or datetime.now(UTC))


def list_run_events(session: Session, run_id: int) -> list[RunEvent]:
    """The history of a run, oldest first; NotFoundError where there is no such run."""
    _row(session, run_id)
    rows = session.scalars(select(RunEventRow).filter_by(run_id=run_id).order_by(RunEventRow.id))
    return [from_row(RunEvent, row, state=RunState(row.state)) for row in rows]


def get_run(session: Session, run_id: int) -> Run:
    """One run, or NotFoundError."""
    return _run(_row(session, run_id))


def latest_of_rig(session: Session, rig: str) -> tuple[Run, int] | None:
    """The run of a rig that was begun, ended or resumed last, and the number of entries in its history."""
    last = select(func.max(RunEventRow.id)).join(RunRow, RunRow.id == RunEventRow.run_id)
    last = last.where(RunRow.rig == rig, RunEventRow.state != RunState.CREATED)
    lately = select(RunEventRow.id).order_by(RunEventRow.id.desc()).limit(_LATELY)
    number = session.scalar(last.where(RunEventRow.id.in_(lately)))
    if number is None:  # a rig that has rested: through its own runs, and not through what all others did meanwhile
        number = session.scalar(last)
    if number is None:
        return None
    run = _run(_row(session, session.get_one(RunEventRow, number).run_id))
    return run, len(list_run_events(session, run.id))


def run_in_short(session: Session, run_id: int) -> RunRow:
    """Article and waveform file of a run, or NotFoundError; not its setup, which may be long.

    A sweep asks for them with every record.
    """
    columns = load_only(RunRow.article, RunRow.waveform_file)
    return get_row(session, RunRow, run_id, "run", options=[columns])


def day_limits(
    first: date | None, last: date | None, zone: tzinfo | None = UTC
) -> tuple[datetime | None, datetime | None]:
    """From the beginning of one day to the end of another, for `list_runs`; without `zone` by this computer's clock."""
    next_day = None if last is None or last == date.max else last + timedelta(days=1)
    since, until = (
        None if day is None else datetime.combine(day, time(), zone).astimezone(zone) for day in (first, next_day)
    )
    return since, until


def list_runs(
    session: Session,
    *,
    kind: str | None = None,
    state: RunState | None = None,
    article: str | None = None,
    specimen: str | None = None,
    text: str | None = None,
    since: datetime | None = None,
    until: datetime | None = None,
    limit: int = 100,
    before: int | None = None,
) -> list[Run]:
    """Runs, optionally of one kind, state or article; the last stored comes first, whatever the clock said.

    With `specimen`, those with a sine record or a result of the cylinders of that joint. With `text`, those whose title
    contains it, in upper or lower case. With `since` (UTC), those that started then or later; with `until` (UTC), those
    that started before it. A page begins before the number `before`.
    """
    numbers = select(RunRow.id).where(*equal(RunRow, kind=kind, state=state, article=article))
    if since is not None or until is not None:
        # Both limits: with one alone SQLite would look at all runs, as it has no idea of how many are beyond it.
        numbers = numbers.where(RunRow.started_at >= (since or _FIRST), RunRow.started_at < (until or _LAST))
    if specimen is not None:
        numbers = numbers.where(runs_with_specimen(RunRow.id, article, specimen))
    if text is not None:
        numbers = numbers.where(RunRow.title.icontains(text, autoescape=True))
    # Numbers first: an index has them with the times, and rows are wide.
    query = select(RunRow).where(RunRow.id.in_(newest_first(numbers, RunRow.id, before, limit)))
    query = query.order_by(RunRow.id.desc()).options(selectinload(RunRow.amendments))
    return [_run(row) for row in session.scalars(query)]


def list_provisional_runs(session: Session, rig: str) -> list[Run]:
    """The provisional runs of `rig` that did not begin."""
    has_history = select(RunEventRow.id).where(RunEventRow.run_id == RunRow.id).exists()
    query = select(RunRow).where(*equal(RunRow, state=RunState.CREATED, rig=rig), ~has_history)
    return [_run(row) for row in session.scalars(query)]


def count_runs(session: Session) -> int:
    """Number of runs."""
    return session.scalar(select(func.count()).select_from(RunRow)) or 0


def _connect(
    session: Session,
    row: RunRow,
    channels: Sequence[StoredChannel],
    instruments: Sequence[Instrument],
    reason: str | None,
    who: str | None,
) -> Run:
    """Connect a run with its instruments, from which the hash of its configuration follows, and note its new state."""
    configuration = {
        "setup": row.setup,
        "sequence": row.sequence,
        "channels": [_plain(channel) for channel in channels],
        "instruments": [_plain(instrument) for instrument in instruments],
    }
    row.configuration_hash = configuration_hash(configuration)
    add_channels(session, row.id, channels)
    details = {calibration_id(session, instrument): instrument.details for instrument in instruments}
    session.add_all(
        RunInstrumentRow(run_id=row.id, calibration_id=each, details=details[each]) for each in sorted(details)
    )
    return _note(session, row, reason, who, row.started_at)


def _note(session: Session, row: RunRow, reason: str | None, who: str | None, happened_at: datetime) -> Run:
    """Add the run's new state to its history."""
    add_row(session, RunEventRow(run_id=row.id, state=row.state, reason=reason, who=who, happened_at=happened_at))
    return _run(row)


def _plain(value: StoredChannel | Instrument) -> dict[str, Any]:
    # Dates have no JSON form. What came later counts where it is set, so that older hashes stay as they are.
    plain = asdict(value)
    holder = plain.get("instrument", plain)
    for name in ("uncertainty", "certificate", "due_on"):
        if holder[name] is None:
            del holder[name]
    if plain.get("polarity", 0) in (None, 1):
        del plain["polarity"]
    for name in ("calibrated_on", "due_on"):
        if holder.get(name) is not None:
            holder[name] = holder[name].isoformat()
    return plain


def _row(session: Session, run_id: int, *, for_update: bool = False) -> RunRow:
    return get_row(session, RunRow, run_id, "run", for_update=for_update)


def _run(row: RunRow) -> Run:
    amended = row.amendments
    setup, version = (amended[-1].setup, amended[-1].version) if amended else (row.setup, AS_MEASURED)
    return from_row(Run, row, state=RunState(row.state), setup=setup, setup_version=version)
