"""Alarms, and the messages about them: each is stored before it is sent, so that it survives the end of a program.

A message is sent until it is delivered or a person acknowledges the alarm. It may arrive twice if a program ends
between the delivery and the note of it; receivers know the second one by the alarm's `uid`.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from uuid import uuid4

from sqlalchemy import Select, and_, or_, select, update
from sqlalchemy.orm import Session

from store.models.rows import add_row, equal, found_or_added, from_row, get_row, newest_first, to_columns
from store.models.service import AlarmDeliveryRow, AlarmRow
from store.states import AlarmKind

LONGEST_PAUSE = timedelta(minutes=15)
"""The longest time between two attempts to deliver a message."""


@dataclass(frozen=True)
class NewAlarm:
    """An alarm to be raised.

    Attributes:
        kind: of its cause.
        text: what has happened, a sentence.
        cause: names the event; a second alarm of the same cause is not raised.
        run_id: of the run that is concerned.
        happened_at: UTC.
        uid: names the alarm everywhere.
    """

    kind: AlarmKind
    rig: str
    text: str
    cause: str
    run_id: int | None = None
    happened_at: datetime = field(default_factory=lambda: datetime.now(UTC))
    uid: str = field(default_factory=lambda: uuid4().hex)


@dataclass(frozen=True, kw_only=True)
class Alarm(NewAlarm):
    """An alarm that was raised; it stands until it is acknowledged. Times are UTC."""

    id: int
    acknowledged_at: datetime | None
    acknowledged_by: str | None
    note: str | None


@dataclass(frozen=True)
class Delivery:
    """A message about an alarm to one channel; times are UTC.

    Attributes:
        alarm_id: number of the alarm.
        channel: such as webhook.
        body: exactly what is sent.
        attempts: how often that was begun.
        tried_at: beginning of the last attempt.
        next_at: time of the next one, unless it is delivered by then.
        result: of the last attempt; None while it is under way.
    """

    id: int
    alarm_id: int
    channel: str
    body: str
    attempts: int
    tried_at: datetime | None
    next_at: datetime
    result: str | None
    delivered_at: datetime | None


@dataclass(frozen=True)
class Sent:
    """A message that was sent while the alarm could not be stored; fields as those of `Delivery`."""

    channel: str
    body: str
    attempts: int
    result: str
    delivered_at: datetime


def add_alarm(session: Session, new: NewAlarm, sent: Iterable[Sent] = ()) -> Alarm | None:
    """Store an alarm, with the messages about it that were delivered before; None where its cause has raised one."""
    query = select(AlarmRow).filter_by(cause=new.cause)
    row, is_new = found_or_added(session, query, lambda: AlarmRow(**to_columns(new, AlarmRow)))
    if not is_new:
        return None
    for each in sent:
        add_row(
            session,
            AlarmDeliveryRow(
                **to_columns(each, AlarmDeliveryRow), alarm_id=row.id, tried_at=each.delivered_at,
                next_at=each.delivered_at,
            ),
        )  # fmt: skip
    return _alarm(row)


def get_alarm(session: Session, alarm_id: int) -> Alarm:
    """One alarm, or NotFoundError."""
    return _alarm(get_row(session, AlarmRow, alarm_id, "alarm"))


def list_alarms(
    session: Session,
    *,
    rig: str | None = None,
    standing: bool | None = None,
    before: int | None = None,
    limit: int = 100,
) -> list[Alarm]:
    """Alarms, newest first; a page begins before the number `before`. `standing`: not acknowledged, or acknowledged."""
    query = select(AlarmRow).where(*equal(AlarmRow, rig=rig))
    if standing is not None:
        query = query.where(AlarmRow.acknowledged_at.is_(None) == standing)
    return [_alarm(row) for row in session.scalars(newest_first(query, AlarmRow.id, before, limit))]


def acknowledge_alarm(session: Session, alarm_id: int, who: str, note: str = "") -> Alarm:
    """Note that a person has seen an alarm; one that was acknowledged before stays as it is.

    Raises NotFoundError if there is no such alarm.
    """
    row = get_row(session, AlarmRow, alarm_id, "alarm", for_update=True)  # somebody else may do so in this moment
    if row.acknowledged_at is None:
        row.acknowledged_at, row.acknowledged_by, row.note = datetime.now(UTC), who, note or None
        session.flush()
    return _alarm(row)


def list_deliveries(session: Session, alarms: Iterable[int]) -> dict[int, list[Delivery]]:
    """The messages about alarms, by the number of the alarm."""
    query = select(AlarmDeliveryRow).where(AlarmDeliveryRow.alarm_id.in_(list(alarms))).order_by(AlarmDeliveryRow.id)
    found = dict[int, list[Delivery]]()
    for row in session.scalars(query):
        found.setdefault(row.alarm_id, []).append(from_row(Delivery, row))
    return found


def is_delivery_due(session: Session, rig: str, channel: str, now: datetime) -> bool:
    """Whether a message about an alarm of the rig has to be sent to the channel."""
    return session.scalars(_due(rig, channel, now)).first() is not None


def claim_delivery(
    session: Session, rig: str, channel: str, now: datetime, lasts: timedelta, compose: Callable[[Alarm], str]
) -> tuple[Alarm, Delivery] | None:
    """The next message to send, and its alarm; None where there is none, or another program is faster.

    Args:
        now: UTC.
        lasts: time that an attempt may take; nobody else makes one within it.
        compose: makes what is sent, once for each alarm.
    """
    row = session.scalars(_due(rig, channel, now)).first()
    if row is None:
        return None
    alarm = _alarm(row)
    query = select(AlarmDeliveryRow).filter_by(alarm_id=alarm.id, channel=channel)
    message = session.scalars(query).one_or_none()
    if message is None:
        body = compose(alarm)
        new = AlarmDeliveryRow(alarm_id=alarm.id, channel=channel, body=body, attempts=0, next_at=now)
        message, is_new = found_or_added(session, query, lambda: new)
        if not is_new:
            return None
    table = AlarmDeliveryRow
    claimed = session.execute(
        update(table)
        .where(table.id == message.id, table.attempts == message.attempts, table.delivered_at.is_(None))
        .values(attempts=table.attempts + 1, tried_at=now, next_at=now + lasts, result=None)
    )
    if claimed.rowcount == 0:  # type: ignore[attr-defined]  # an UPDATE has one
        return None
    session.refresh(message)
    return alarm, from_row(Delivery, message)


def note_delivery(session: Session, delivery_id: int, result: str, *, delivered: bool, next_at: datetime) -> None:
    """Store the result of an attempt, and the time of the next one in case it failed."""
    row = get_row(session, AlarmDeliveryRow, delivery_id, "message about an alarm")
    row.result, row.next_at = result, next_at
    if delivered:
        row.delivered_at = datetime.now(UTC)
    session.flush()


def _due(rig: str, channel: str, now: datetime) -> Select[AlarmRow]:
    """The alarm to send first. A time further ahead than any pause comes from a clock that was set back."""
    table = AlarmDeliveryRow
    own = and_(table.alarm_id == AlarmRow.id, table.channel == channel)
    in_time = or_(table.next_at <= now, table.next_at > now + LONGEST_PAUSE)
    return (
        select(AlarmRow)
        .outerjoin(table, own)
        .where(AlarmRow.rig == rig, AlarmRow.acknowledged_at.is_(None))
        .where(or_(table.id.is_(None), and_(table.delivered_at.is_(None), in_time)))
        .order_by(AlarmRow.id)
        .limit(1)
    )


def _alarm(row: AlarmRow) -> Alarm:
    return from_row(Alarm, row, kind=AlarmKind(row.kind))
