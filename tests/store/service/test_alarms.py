"""Alarms: one for each cause, told until somebody acknowledges them, and nothing of it is lost or done twice."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta

import pytest

from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.service.alarms import (
    LONGEST_PAUSE,
    Alarm,
    Delivery,
    NewAlarm,
    Sent,
    acknowledge_alarm,
    add_alarm,
    claim_delivery,
    get_alarm,
    is_delivery_due,
    list_alarms,
    list_deliveries,
    note_delivery,
)
from store.states import AlarmKind
from tests.databases import is_waiting
from tests.postgresql_server import Server
from tests.waiting import until

NOW = datetime(2026, 11, 23, 2, tzinfo=UTC)
LASTS = timedelta(seconds=20)
Raise = Callable[..., Alarm]


@pytest.fixture
def raise_alarm(catalogue: Catalogue) -> Raise:
    def raise_one(cause: str, rig: str = "rig") -> Alarm:
        with catalogue.writing() as session:
            alarm = add_alarm(session, NewAlarm(AlarmKind.TEST, rig, f"{cause} happened", cause))
        assert alarm is not None
        return alarm

    return raise_one


def claim(catalogue: Catalogue, now: datetime = NOW, channel: str = "webhook") -> tuple[Alarm, Delivery] | None:
    with catalogue.writing() as session:
        return claim_delivery(session, "rig", channel, now, LASTS, lambda alarm: f"about {alarm.text}")


def claimed(catalogue: Catalogue, now: datetime = NOW, channel: str = "webhook") -> Delivery:
    found = claim(catalogue, now, channel)
    assert found is not None
    return found[1]


def test_a_cause_raises_one_alarm(catalogue: Catalogue, raise_alarm: Raise) -> None:
    first = raise_alarm("run 1 ended")
    with catalogue.writing() as session:
        assert add_alarm(session, NewAlarm(AlarmKind.TEST, "rig", "again", "run 1 ended")) is None
    with catalogue.reading() as session:
        assert list_alarms(session) == [first]


def test_alarms_are_listed_by_rig_and_by_whether_they_stand(catalogue: Catalogue, raise_alarm: Raise) -> None:
    first, second, other = raise_alarm("1"), raise_alarm("2"), raise_alarm("3", rig="other")
    with catalogue.writing() as session:
        done = acknowledge_alarm(session, first.id, "ann", "pump was off")
    with catalogue.reading() as session:
        assert list_alarms(session, rig="rig", standing=True) == [second]
        assert list_alarms(session, standing=False) == [done]
        assert list_alarms(session, before=other.id, limit=1) == [second]


def test_the_first_acknowledgement_stays(catalogue: Catalogue, raise_alarm: Raise) -> None:
    alarm = raise_alarm("1")
    with catalogue.writing() as session:
        first = acknowledge_alarm(session, alarm.id, "ann", "pump was off")
        assert acknowledge_alarm(session, alarm.id, "bob", "me too") == first
    assert (first.acknowledged_by, first.note, first.acknowledged_at is None) == ("ann", "pump was off", False)
    with catalogue.reading() as session, pytest.raises(NotFoundError, match="no alarm 99"):
        get_alarm(session, 99)


def test_each_channel_gets_a_message_until_it_is_delivered(catalogue: Catalogue, raise_alarm: Raise) -> None:
    alarm = raise_alarm("1")
    first = claimed(catalogue)
    assert (first.body, first.attempts, first.result, first.tried_at) == ("about 1 happened", 1, None, NOW)
    assert claim(catalogue, NOW + LASTS / 2) is None  # the attempt is under way, here or in another program
    second = claimed(catalogue, NOW + LASTS)  # who claimed it first has died
    assert (second.id, second.body, second.attempts) == (first.id, first.body, 2)
    with catalogue.writing() as session:
        note_delivery(session, second.id, "no route", delivered=False, next_at=NOW + 2 * LASTS)
    assert claimed(catalogue, NOW + 2 * LASTS).attempts == 3
    with catalogue.writing() as session:
        note_delivery(session, second.id, "200 OK", delivered=True, next_at=NOW)
    assert claim(catalogue, NOW + 3 * LASTS) is None
    assert claimed(catalogue, channel="mail").attempts == 1
    with catalogue.reading() as session:
        assert [each.channel for each in list_deliveries(session, [alarm.id])[alarm.id]] == ["webhook", "mail"]


def test_nobody_is_told_of_what_was_acknowledged_or_happened_at_another_rig(
    catalogue: Catalogue, raise_alarm: Raise
) -> None:
    alarm = raise_alarm("1")
    raise_alarm("2", rig="other")
    with catalogue.reading() as session:
        assert is_delivery_due(session, "rig", "webhook", NOW)
    with catalogue.writing() as session:
        acknowledge_alarm(session, alarm.id, "ann")
    with catalogue.reading() as session:
        assert not is_delivery_due(session, "rig", "webhook", NOW)
    assert claim(catalogue) is None


def test_a_message_that_fails_does_not_hold_up_the_next_one(catalogue: Catalogue, raise_alarm: Raise) -> None:
    first, second = raise_alarm("1"), raise_alarm("2")
    assert claimed(catalogue).alarm_id == first.id
    assert claimed(catalogue).alarm_id == second.id


def test_a_clock_that_is_set_back_delays_no_message_by_more_than_a_pause(
    catalogue: Catalogue, raise_alarm: Raise
) -> None:
    raise_alarm("1")
    claimed(catalogue, NOW + LONGEST_PAUSE)
    assert claimed(catalogue, NOW).attempts == 2


def test_what_was_told_while_the_database_was_away_is_not_told_again(catalogue: Catalogue) -> None:
    new = NewAlarm(AlarmKind.DATABASE_AWAY, "rig", "it was away", "away since noon")
    with catalogue.writing() as session:
        add_alarm(session, new, [Sent("webhook", "body", 2, "200 OK", NOW)])
    assert claim(catalogue) is None
    assert claimed(catalogue, channel="mail").attempts == 1


@pytest.mark.parametrize("database_kind", ["postgresql"])  # SQLite has one writer at a time
def test_of_two_who_acknowledge_at_the_same_time_the_first_one_stays(
    catalogue: Catalogue, raise_alarm: Raise, postgresql: Server
) -> None:
    alarm = raise_alarm("run 1 ended")

    def acknowledge(who: str) -> Alarm:
        with catalogue.writing() as session:
            return acknowledge_alarm(session, alarm.id, who)

    with ThreadPoolExecutor(1) as other:
        with catalogue.writing() as session:
            first = acknowledge_alarm(session, alarm.id, "ann", "pump was off")
            second = other.submit(acknowledge, "bob")
            until(lambda: second.done() or is_waiting(postgresql))
        assert second.result() == first
    with catalogue.reading() as session:
        assert get_alarm(session, alarm.id) == first
