"""`jointlab mqtt` between a service on simulated instruments and a broker, both of which go away and come back."""

import signal
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import pytest

from api.cli import INTERRUPTED
from jointlab.client import Client
from jointlab.publishing import mqtt
from jointlab.publishing.messages import Message
from jointlab.publishing.mqtt import _Documents
from jointlab.publishing.service import BEFORE_THE_FIRST, Service
from tests.api.conftest import paper
from tests.fault_proxy import FaultProxy
from tests.jointlab.publishing.conftest import Reader, command_process, expect_state, reading
from tests.mqtt_broker import broker_process
from tests.ports import free_port
from tests.waiting import LONG, until

SMALL = {"step": "hammer", "points": ["5y", "1x"], "blows": 2, "block_seconds": 1.0}


@pytest.fixture
def port() -> Iterator[int]:
    """The port of a broker."""
    port = free_port()
    with broker_process(port):
        yield port


@pytest.fixture
def broker_line(port: int) -> Iterator[FaultProxy]:
    """A line to the broker that a test may cut."""
    proxy = FaultProxy(f"127.0.0.1:{port}")
    yield proxy
    proxy.stop()


@pytest.fixture
def reader(
    port: int, lab: Client, broker_line: FaultProxy, service_line: FaultProxy, tmp_path: Path
) -> Iterator[Reader]:
    """Somebody who reads what is published of the rig, as soon as it is."""
    words = ("mqtt", f"mqtt://{broker_line.address}", "--service", f"http://{service_line.address}")
    with reading(port) as reader, command_process(tmp_path, *words):
        until(lambda: bool(reader.latest("availability") == "online"))
        yield reader


def kept_events(lab: Client) -> list[str]:
    """The ids of all events that the service has kept."""
    latest = lab.rig().latest_event
    found: list[str] = []
    with lab.events(BEFORE_THE_FIRST) as events:
        while len(found) < latest:
            found.append(next(events).id)
    return found


def drive(lab: Client, holder: str) -> None:
    """Two events: somebody drives, and nobody does."""
    with lab.driving(holder):
        assert lab.rig().driven_by == holder


def expect_events(reader: Reader, lab: Client, since: int) -> None:
    """Wait for all events but the first so many; each came once, in order."""
    expected = kept_events(lab)[since:]
    until(lambda: len(reader.events) >= len(expected))
    assert [event["id"] for event in reader.events] == expected


def test_a_run_is_told_as_it_happens(reader: Reader, lab: Client, port: int) -> None:
    before = lab.rig().latest_event
    run = lab.create_run(paper() | {"steps": [SMALL]})
    with lab.driving("test") as driver:
        driver.start(run.id, automatic=True)
        lab.wait_for_run(run.id)
    expect_events(reader, lab, before)
    expect_state(reader, lab)
    assert reader.latest("state")["run_id"] == run.id
    phases = [value for topic, value, _ in reader.messages if topic == "state" and '"phase":"running"' in value]
    assert phases, "the state did not follow the run"
    blow = next(event for event in reader.events if event["event"] == "BlowAccepted")
    assert (blow["data"]["point"], blow["data"]["wanted"]) == ("5y", 2)
    assert reader.latest("events/BlowAccepted")["data"]["point"] == "1x"
    with reading(port) as late:
        expect_state(late, lab)
        until(lambda: late.latest("results") == [] and late.latest("alarms") == [])
        assert all(retained for _, _, retained in late.messages)


def test_after_the_broker_was_away_state_and_events_are_whole(
    reader: Reader, lab: Client, broker_line: FaultProxy
) -> None:
    before = lab.rig().latest_event
    drive(lab, "first")
    expect_events(reader, lab, before)
    broker_line.cut()
    until(lambda: bool(reader.latest("availability") == "offline"))
    for number in range(20):
        drive(lab, f"number {number}")
    broker_line.repair()
    expect_events(reader, lab, before)
    expect_state(reader, lab)


def test_after_the_service_was_away_state_and_events_are_whole(
    reader: Reader, lab: Client, service_line: FaultProxy
) -> None:
    before = lab.rig().latest_event
    service_line.cut()
    until(lambda: bool(reader.latest("availability") == "offline"))
    drive(lab, "meanwhile")
    assert lab.stop() is None
    service_line.repair()
    expect_events(reader, lab, before)
    expect_state(reader, lab)
    assert reader.latest("state")["stop"]["epoch"] >= 1


def test_a_broker_that_has_forgotten_everything_is_told_again(lab: Client, tmp_path: Path) -> None:
    port = free_port()
    words = ("mqtt", f"mqtt://127.0.0.1:{port}", "--service", lab_address(lab))
    with ExitStack() as stack:
        with broker_process(port):
            stack.enter_context(command_process(tmp_path, *words))
            with reading(port) as reader:
                expect_state(reader, lab)
        with broker_process(port), reading(port) as reader:
            expect_state(reader, lab)
            until(lambda: reader.latest("alarms") == [])


def test_who_ends_the_program_leaves_offline_behind(port: int, lab: Client, tmp_path: Path) -> None:
    words = ("mqtt", f"mqtt://127.0.0.1:{port}", "--service", lab_address(lab))
    with reading(port) as reader:
        for end in (signal.SIGTERM, signal.SIGKILL, signal.SIGINT):
            with command_process(tmp_path, *words) as process:
                until(lambda: bool(reader.latest("availability") == "online"))
                process.send_signal(end)
                until(lambda: bool(reader.latest("availability") == "offline"))
                assert process.wait(LONG) == (INTERRUPTED if end == signal.SIGINT else -end)


def test_a_message_to_any_topic_changes_nothing(reader: Reader, lab: Client) -> None:
    before: Any = lab.rig()
    told = len(reader.events)
    topics = ("state", "state/set", "availability", "stop", "command", "events", "alarms/acknowledge", "runs/start")
    for topic in topics:
        for payload in ("", "stop", "offline", '{"phase":"running","run_id":7}'):
            reader.publish(f"jointlab/rig/{topic}", payload)
    assert lab.rig() == before
    assert list(lab.runs()) == []
    drive(lab, "afterwards")  # and all goes on
    until(lambda: len(reader.events) == told + 2)
    until(lambda: bool(reader.latest("state") == lab.rig().model_dump(mode="json")))


class Notes:
    """In place of a broker: what it was given."""

    connections = 1

    def __init__(self) -> None:
        self.topics: list[str] = []

    def deliver(self, message: Message) -> None:
        self.topics.append(message.topic.removeprefix("jointlab/rig/"))


def test_what_another_client_has_replaced_is_published_again(lab: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    every = ["state", "availability", "alarms", "results"]
    with closing(Service(lab_address(lab), None)) as service:
        notes = Notes()
        documents = _Documents(service, notes, "jointlab/rig", "rig")
        for _ in range(3):
            documents.publish()
        assert notes.topics == every
        monkeypatch.setattr(mqtt, "REPETITION", 0.0)
        documents.publish()
        assert set(notes.topics[len(every) :]) == set(every)


def lab_address(lab: Client) -> str:
    return str(lab._connection._http.base_url).removesuffix("/api/")
