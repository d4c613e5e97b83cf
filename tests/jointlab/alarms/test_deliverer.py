"""Delivery from stored rows: it is retried until it succeeds or somebody knows, whatever is killed, and in time."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from datetime import timedelta
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from jointlab.alarms import deliverer
from jointlab.alarms.channel import AlarmChannel, NotDeliveredError
from jointlab.alarms.deliverer import Deliverer, pause_after
from jointlab.alarms.mail import Mail
from jointlab.alarms.settings import MailSettings
from jointlab.alarms.unstored import UnstoredAlarms
from jointlab.alarms.webhook import Webhook
from store.catalogue import Catalogue
from store.errors import StoreError
from store.service.alarms import (
    LONGEST_PAUSE,
    Delivery,
    NewAlarm,
    acknowledge_alarm,
    list_alarms,
    list_deliveries,
    note_delivery,
)
from store.states import AlarmKind
from tests.jointlab.alarms.conftest import Raise
from tests.jointlab.alarms.receivers import Received, mail_server, silent_server
from tests.waiting import until

DEADLINE = 1.0  # s


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pauses of a hundredth."""
    for name in ("POLL", "FIRST_PAUSE", "PATIENCE"):
        monkeypatch.setattr(deliverer, name, getattr(deliverer, name) / 100)


@pytest.fixture
def unstored(tmp_path: Path) -> UnstoredAlarms:
    return UnstoredAlarms(tmp_path / "drive" / "alarms.json")


@pytest.fixture
def deliver(catalogue: Catalogue, unstored: UnstoredAlarms) -> Iterator[SimpleNamespace]:
    """Start deliverers, which are closed in the end."""
    with ExitStack() as stack:

        def start(channel: AlarmChannel) -> Deliverer:
            started = Deliverer(catalogue, "rig", channel, DEADLINE, unstored)
            stack.callback(started.close)
            return started

        yield SimpleNamespace(by=start)


def deliveries(catalogue: Catalogue) -> list[Delivery]:
    with catalogue.reading() as session:
        found = list_deliveries(session, [alarm.id for alarm in list_alarms(session)])
    return [each for one in found.values() for each in one]


def is_delivered(catalogue: Catalogue) -> bool:
    return any(each.delivered_at is not None for each in deliveries(catalogue))


def test_a_receiver_that_fails_twice_is_told_the_third_time(
    catalogue: Catalogue, receiver: Received, raise_alarm: Raise, deliver: SimpleNamespace
) -> None:
    receiver.statuses = [500, 503, 200]
    alarm = raise_alarm()
    deliver.by(Webhook(receiver.url, "a secret", DEADLINE))
    until(lambda: is_delivered(catalogue))
    (sent,) = deliveries(catalogue)
    assert (sent.alarm_id, sent.channel, sent.attempts, sent.result) == (alarm.id, "webhook", 3, "200 OK")
    assert receiver.bodies == [sent.body.encode()] * 3  # exactly what is stored, under one id
    assert {each["Jointlab-Alarm"] for each in receiver.headers} == {alarm.uid}


def test_a_mail_server_that_defers_a_message_gets_it_again(
    catalogue: Catalogue, raise_alarm: Raise, deliver: SimpleNamespace
) -> None:
    raise_alarm()
    with mail_server() as post:
        post.deferred = 1
        given = MailSettings(host="localhost", port=post.port, security="none", sender="a@b.c", to=("d@e.f",))
        deliver.by(Mail(given, None, DEADLINE))
        until(lambda: is_delivered(catalogue))
    assert deliveries(catalogue)[0].attempts == 2
    assert len(post.messages) == 1


def test_a_receiver_that_never_answers_delays_no_other_channel(
    catalogue: Catalogue, receiver: Received, raise_alarm: Raise, deliver: SimpleNamespace
) -> None:
    with silent_server() as port:
        deliver.by(Mail(MailSettings(host="localhost", port=port, sender="a@b.c", to=("d@e.f",)), None, DEADLINE))
        raise_alarm()
        deliver.by(Webhook(receiver.url, None, DEADLINE))
        until(lambda: is_delivered(catalogue))
        until(lambda: any(each.channel == "mail" and each.result is not None for each in deliveries(catalogue)))
    (silent,) = [each for each in deliveries(catalogue) if each.channel == "mail"]
    assert silent.delivered_at is None


def test_nobody_is_told_any_more_of_what_somebody_has_acknowledged(
    catalogue: Catalogue, receiver: Received, raise_alarm: Raise, deliver: SimpleNamespace, unstored: UnstoredAlarms
) -> None:
    receiver.statuses = [500]
    first = raise_alarm("first")
    with closing(Deliverer(catalogue, "rig", Webhook(receiver.url, None, DEADLINE), DEADLINE, unstored)):
        until(lambda: len(receiver.bodies) > 1)
        with catalogue.writing() as session:
            acknowledge_alarm(session, first.id, "ann")
    receiver.statuses = [200]
    receiver.bodies.clear()
    deliver.by(Webhook(receiver.url, None, DEADLINE))
    second = raise_alarm("second")
    until(lambda: is_delivered(catalogue))
    assert all(second.uid.encode() in body for body in receiver.bodies)


@dataclass
class Interrupted:
    """A channel that delivers; `meanwhile` is called when the receiver has got the message, before its answer."""

    meanwhile: Callable[[], object]
    name: str = "webhook"
    bodies: list[str] = field(default_factory=list)

    def compose(self, alarm: NewAlarm) -> str:
        return f"about {alarm.uid}"

    def send(self, uid: str, body: str) -> str:
        self.bodies.append(body)
        self.meanwhile()
        return "200 OK"


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")  # it is what this is about
def test_a_service_that_is_killed_while_it_sends_is_followed_by_one_that_sends_the_same(
    catalogue: Catalogue, receiver: Received, raise_alarm: Raise, unstored: UnstoredAlarms
) -> None:
    # ends its thread, as a kill would: nothing is noted
    alarm, dying = raise_alarm(), Interrupted(Mock(side_effect=SystemExit))
    with closing(Deliverer(catalogue, "rig", dying, 0.1, unstored)):
        until(lambda: bool(dying.bodies))
    with closing(Deliverer(catalogue, "rig", Webhook(receiver.url, None, DEADLINE), DEADLINE, unstored)):
        until(lambda: is_delivered(catalogue))
    assert receiver.bodies == [each.encode() for each in dying.bodies] == [f"about {alarm.uid}".encode()]
    assert deliveries(catalogue)[0].attempts == 2


def test_an_alarm_that_cannot_be_stored_is_told_all_the_same_and_once(
    catalogue: Catalogue, receiver: Received, unstored: UnstoredAlarms, deliver: SimpleNamespace, tmp_path: Path
) -> None:
    receiver.statuses = [500, 200]
    unstored.add(NewAlarm(AlarmKind.DATABASE_AWAY, "rig", "the database is away", "away since noon"))
    deliver.by(Webhook(receiver.url, None, DEADLINE))
    until(lambda: unstored.unsent("webhook", 0.0) == [])
    again = UnstoredAlarms(tmp_path / "drive" / "alarms.json")  # of the next service
    assert (again.unsent("webhook", 0.0), len(again.unsent("mail", 0.0))) == ([], 1)
    again.store(catalogue)
    (sent,) = deliveries(catalogue)
    assert (sent.attempts, sent.body.encode(), sent.result) == (2, receiver.bodies[-1], "200 OK")
    assert sent.delivered_at is not None
    assert UnstoredAlarms(tmp_path / "drive" / "alarms.json").alarms == ()


def test_an_alarm_that_is_stored_while_it_is_sent_is_told_once(
    catalogue: Catalogue, unstored: UnstoredAlarms, deliver: SimpleNamespace
) -> None:
    away = NewAlarm(AlarmKind.DATABASE_AWAY, "rig", "the database is away", "away since noon")
    channel = Interrupted(lambda: unstored.store(catalogue))  # it is back in this moment
    unstored.add(away)
    deliver.by(channel)
    until(lambda: is_delivered(catalogue))
    assert channel.bodies == [f"about {away.uid}"]
    assert [(each.attempts, each.result) for each in deliveries(catalogue)] == [(1, "200 OK")]


def test_a_message_whose_delivery_cannot_be_noted_at_once_is_not_sent_again(
    catalogue: Catalogue, raise_alarm: Raise, deliver: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(deliverer, "note_delivery", away := Mock(side_effect=StoreError("the database is away")))
    alarm, channel = raise_alarm(), Interrupted(lambda: None)
    with monkeypatch.context() as quickly:
        quickly.setattr("store.service.alarms.LONGEST_PAUSE", timedelta())  # the next attempt is due at once
        deliver.by(channel)
        until(lambda: away.call_count > 1)
        monkeypatch.setattr(deliverer, "note_delivery", note_delivery)
        until(lambda: is_delivered(catalogue))
    assert channel.bodies == [f"about {alarm.uid}"]


def test_pauses_grow_up_to_the_longest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    assert [pause_after(n).total_seconds() for n in (1, 2, 3)] == [5, 10, 20]
    assert pause_after(100) == LONGEST_PAUSE == timedelta(minutes=15)
    assert str(NotDeliveredError("a\r\nb\x1b")) == "a  b "
