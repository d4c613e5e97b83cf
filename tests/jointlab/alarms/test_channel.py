"""Webhook and e-mail on real sockets: what arrives, what counts as delivered, and an end in time whatever answers."""

import hashlib
import hmac
import json
import ssl
import time
from datetime import UTC, datetime
from email import message_from_string
from email.policy import default
from pathlib import Path

import pytest

from jointlab.alarms.channel import AlarmChannel, NotDeliveredError
from jointlab.alarms.mail import Mail
from jointlab.alarms.settings import MailSettings
from jointlab.alarms.webhook import Webhook
from store.service.alarms import NewAlarm
from store.states import AlarmKind
from tests.jointlab.alarms.receivers import Received, mail_server, silent_server

ALARM = NewAlarm(
    AlarmKind.RUN_ENDED, "rig 2", "run 7 (beam 3, 23 °C) on rig 2 has failed: interlock\nBcc: all", "run 7", 7,
    datetime(2026, 11, 23, 2, 30, tzinfo=UTC),
)  # fmt: skip
SOON = 1.0  # s


def mail_to(port: int, *to: str, **others: object) -> MailSettings:
    given = {"host": "localhost", "port": port, "security": "none", "sender": "rig@lab.example", "to": to or ("a@b.c",)}
    return MailSettings.model_validate(given | others)


def test_a_webhook_gets_the_alarm_as_json_with_its_signature(receiver: Received) -> None:
    webhook = Webhook(receiver.url, "a secret", 5.0)
    body = webhook.compose(ALARM)
    assert webhook.send(ALARM.uid, body) == "200 OK"
    assert receiver.bodies == [body.encode()]
    (headers,) = receiver.headers
    expected = hmac.new(b"a secret", receiver.bodies[0], hashlib.sha256).hexdigest()
    assert (headers["Jointlab-Signature"], headers["Jointlab-Alarm"]) == (f"sha256={expected}", ALARM.uid)
    assert json.loads(body) == {
        "id": ALARM.uid, "kind": "run_ended", "title": "a run has ended by itself", "rig": "rig 2", "run": 7,
        "text": ALARM.text, "happened_at": "2026-11-23T02:30:00+00:00",
    }  # fmt: skip


def test_without_a_secret_there_is_no_signature(receiver: Received) -> None:
    Webhook(receiver.url, None, 5.0).send("1", "{}")
    assert "Jointlab-Signature" not in receiver.headers[0]


@pytest.mark.parametrize("status", [301, 404, 500])
def test_another_status_than_success_is_no_delivery(receiver: Received, status: int) -> None:
    receiver.statuses = [status]
    with pytest.raises(NotDeliveredError, match=str(status)):
        Webhook(receiver.url, None, 5.0).send("1", "{}")
    assert len(receiver.bodies) == 1  # a redirection is not followed


def test_an_address_and_a_secret_are_in_no_text_that_is_logged(receiver: Received) -> None:
    assert receiver.url not in repr(Webhook(receiver.url, "a secret", 5.0))
    assert "secret" not in repr(Webhook(receiver.url, "a secret", 5.0)).replace("_secret", "")
    receiver.statuses = [500]
    with pytest.raises(NotDeliveredError) as refused:
        Webhook(receiver.url, "a secret", 5.0).send("1", "{}")
    assert "room" not in str(refused.value)


def channel_to(kind: str, port: int) -> AlarmChannel:
    if kind == "mail":
        return Mail(mail_to(port), None, SOON)
    return Webhook(f"{'https' if kind == 'webhook over TLS' else 'http'}://127.0.0.1:{port}/", None, SOON)


@pytest.mark.parametrize("said", [b"", b"H", b"220-" + b"x" * 60 + b"\r\n"], ids=["nothing", "a byte", "lines"])
@pytest.mark.parametrize("kind", ["webhook", "webhook over TLS", "mail"])
def test_a_receiver_that_never_answers_as_a_whole_is_given_up_in_time(kind: str, said: bytes) -> None:
    with silent_server(said) as port:
        began = time.monotonic()
        with pytest.raises(NotDeliveredError):
            channel_to(kind, port).send("1", "{}")
        assert time.monotonic() - began > SOON / 2 or said  # what is no HTTP is refused at once


@pytest.mark.parametrize("kind", ["webhook", "mail"])
def test_a_receiver_that_is_not_there_is_named_by_its_error(kind: str) -> None:
    with pytest.raises(NotDeliveredError, match="refused"):
        channel_to(kind, 9).send("1", "{}")


def test_a_mail_says_what_has_happened_where_and_when() -> None:
    with mail_server() as post:
        mail = Mail(mail_to(post.port, "ann@lab.example", "bob@lab.example"), None, 5.0)
        assert mail.send(ALARM.uid, mail.compose(ALARM)) == "taken"
    message = message_from_string(post.messages[0], policy=default)
    assert message["Subject"] == "Jointlab, rig 2: a run has ended by itself"
    assert message["To"] == "ann@lab.example, bob@lab.example"
    assert message["Message-ID"] == f"<{ALARM.uid}@jointlab>"
    assert message["Bcc"] is None
    text = message.get_content()
    assert "run 7 (beam 3, 23 °C) on rig 2 has failed: interlock" in text
    assert "2026-11-23 02:30:00 UTC" in text


def test_a_mail_that_one_recipient_gets_is_delivered_and_the_others_are_named() -> None:
    with mail_server() as post:
        post.refused = {"bob@lab.example"}
        mail = Mail(mail_to(post.port, "ann@lab.example", "bob@lab.example"), None, 5.0)
        assert mail.send("1", mail.compose(ALARM)) == "taken, but not for bob@lab.example"
        post.refused |= {"ann@lab.example"}
        with pytest.raises(NotDeliveredError, match="nobody of that name"):
            mail.send("1", mail.compose(ALARM))
    assert len(post.messages) == 1


def test_a_password_is_sent_over_tls_to_a_known_server_alone(
    certificate: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    context.load_cert_chain(*certificate)
    with mail_server(context) as post:
        mail = Mail(mail_to(post.port, security="starttls", user="rig"), "pass word", 5.0)
        body = mail.compose(ALARM)
        with pytest.raises(NotDeliveredError, match="certificate"):
            mail.send("1", body)
        monkeypatch.setenv("SSL_CERT_FILE", str(certificate[0]))
        assert mail.send("1", body) == "taken"
    assert (post.logins, post.encrypted) == (["\0rig\0pass word"], [True])
    assert "pass word" not in repr(mail)


def test_a_server_without_tls_gets_no_password() -> None:
    with mail_server() as post, pytest.raises(NotDeliveredError, match="STARTTLS"):
        Mail(mail_to(post.port, security="starttls", user="rig"), "pass word", 5.0).send("1", "x")
    assert (post.logins, post.messages) == ([], [])
