"""The connection to a broker: refusals in one line, encryption, and nothing that grows while the broker is away."""

import socket
from pathlib import Path

import pytest
from pydantic import ValidationError

from jointlab.background import in_background
from jointlab.errors import JointlabError
from jointlab.publishing.broker import Broker
from jointlab.publishing.messages import Message, availability_message
from jointlab.publishing.settings import MqttSettings
from tests.certificates import certificate_in
from tests.fault_proxy import FaultProxy
from tests.jointlab.publishing.conftest import reading
from tests.mqtt_broker import broker_process
from tests.ports import free_port
from tests.waiting import until

BASE = "jointlab/rig"


def broker(address: str, user: str | None = None, password: str | None = None) -> Broker:
    will = availability_message(BASE, answers=False)
    return Broker(MqttSettings(broker=address, user=user), password, BASE, will)


def test_no_broker_is_one_line_that_says_what_to_do() -> None:
    port = free_port()
    with pytest.raises(JointlabError, match=f"no MQTT broker answers at mqtt://127.0.0.1:{port} .*correct its address"):
        broker(f"mqtt://127.0.0.1:{port}").__enter__()


def test_a_port_of_something_else_is_no_broker() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        found = broker(f"mqtt://127.0.0.1:{other.getsockname()[1]}")
        ended = in_background(found.__enter__)
        with other.accept()[0]:
            pass  # closed without a word
        with pytest.raises(JointlabError, match="correct address, user or JOINTLAB_MQTT_PASSWORD"):
            ended.result(60)


def test_a_wrong_password_is_one_line_that_names_its_variable() -> None:
    port = free_port()
    with broker_process(port, user=("rig", "secret")):
        with broker(f"mqtt://127.0.0.1:{port}", "rig", "secret") as allowed:
            assert allowed.connections == 1
        with pytest.raises(JointlabError, match="JOINTLAB_MQTT_PASSWORD"):
            broker(f"mqtt://127.0.0.1:{port}", "rig", "guess").__enter__()


# paho leaves the socket to the collector where a certificate is refused
@pytest.mark.filterwarnings("ignore:Exception ignored in. <ssl.SSLSocket:pytest.PytestUnraisableExceptionWarning")
def test_an_encrypted_broker_is_used_where_its_certificate_is_known(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    certificate, key = certificate_in(tmp_path, "DNS:localhost,IP:127.0.0.1")
    port = free_port()
    with broker_process(port, tls=(certificate, key)):
        with pytest.raises(JointlabError, match="certificate"):
            broker(f"mqtts://127.0.0.1:{port}").__enter__()
        monkeypatch.setenv("SSL_CERT_FILE", str(certificate))
        with broker(f"mqtts://127.0.0.1:{port}") as encrypted:
            encrypted.deliver(Message(f"{BASE}/state", b"{}", retained=True))


def test_while_the_broker_is_away_one_message_waits_and_no_more() -> None:
    port = free_port()
    with broker_process(port), reading(port) as reader:
        line = FaultProxy(f"127.0.0.1:{port}")
        sent = []
        with broker(f"mqtt://{line.address}") as away:

            def deliver() -> None:
                for number in range(100):
                    sent.append(number)
                    away.deliver(Message(f"{BASE}/events/Number", str(number).encode(), retained=False))

            line.cut()
            until(lambda: reader.latest("availability") == "offline")
            ended = in_background(deliver)
            until(lambda: bool(sent))
            assert sent == [0]
            assert len(away._client._out_messages) <= 1
            line.repair()
            ended.result(60)
        line.stop()
        until(lambda: len(reader.events) == 100)
        assert [str(event) for event in reader.events] == [str(number) for number in range(100)]


@pytest.mark.parametrize(
    ("address", "user", "why"),
    [
        ("http://broker", None, "no address of a broker; give mqtt://host:port"),
        ("broker:1883", None, "no address of a broker"),
        ("mqtt://", None, "no address of a broker"),
        ("mqtt://broker:port", None, "Port could not be cast"),
        ("mqtt://rig:secret@broker", None, "leave the user out of the address"),
        ("mqtt://broker", "rig", "a password is not sent without encryption; use mqtts://"),
    ],
)
def test_an_address_that_cannot_be_used_is_refused(address: str, user: str | None, why: str) -> None:
    with pytest.raises(ValidationError, match=why):
        MqttSettings(broker=address, user=user)


@pytest.mark.parametrize(("address", "port"), [("mqtt://b", 1883), ("mqtts://b", 8883), ("mqtts://b:1", 1)])
def test_the_port_is_by_default_that_of_the_protocol(address: str, port: int) -> None:
    assert MqttSettings(broker=address).port == port


@pytest.mark.parametrize("prefix", ["", "a/#", "+", "/a", "a/", "$SYS"])
def test_a_prefix_is_part_of_a_topic(prefix: str) -> None:
    with pytest.raises(ValidationError, match="prefix"):
        MqttSettings(broker="mqtt://b", prefix=prefix)
