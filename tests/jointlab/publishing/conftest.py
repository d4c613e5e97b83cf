"""The fixtures of the service, brokers, and who reads from them."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
from paho.mqtt.client import Client as PahoClient
from paho.mqtt.enums import CallbackAPIVersion

from jointlab.client import Client
from tests.api.service.conftest import acting, catalogue, make_key, rig, rig_client, rig_settings
from tests.fault_proxy import FaultProxy
from tests.waiting import until

__all__ = ["acting", "catalogue", "make_key", "rig", "rig_client", "rig_settings"]
ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def lab(rig_client: httpx.Client) -> Iterator[Client]:
    with Client(str(rig_client.base_url)) as lab:
        yield lab


@pytest.fixture
def service_line(rig_client: httpx.Client) -> Iterator[FaultProxy]:
    """A line to the service that a test may cut."""
    proxy = FaultProxy(rig_client.base_url.netloc.decode())
    yield proxy
    proxy.stop()


class Reader:
    """Somebody who reads all that a broker says, each message with its topic below that of the rig."""

    def __init__(self, port: int) -> None:
        self.messages: list[tuple[str, str, bool]] = []
        self._client = PahoClient(CallbackAPIVersion.VERSION2)
        self._client.on_connect = lambda client, *_: client.subscribe("jointlab/#", qos=1)
        self._client.on_message = self._take
        self._client.connect("127.0.0.1", port)
        self._client.loop_start()

    def _take(self, _client: object, _data: object, message: Any) -> None:
        topic = message.topic.removeprefix("jointlab/rig/")
        self.messages.append((topic, message.payload.decode(), message.retain))

    def latest(self, topic: str) -> Any:
        """The newest payload of a topic, without quotes where it is a word; None where there is none."""
        found = [payload for each, payload, _ in list(self.messages) if each == topic]
        return None if not found else found[-1] if found[-1] in ("online", "offline") else json.loads(found[-1])

    @property
    def events(self) -> list[dict[str, Any]]:
        """Payloads of events in the order in which they came."""
        return [json.loads(payload) for topic, payload, _ in list(self.messages) if topic.startswith("events/")]

    def publish(self, topic: str, payload: str) -> None:
        """Publish to a topic in full."""
        self._client.publish(topic, payload, qos=1).wait_for_publish(60)

    def close(self) -> None:
        self._client.disconnect()
        self._client.loop_stop()


@contextmanager
def reading(port: int) -> Iterator[Reader]:
    reader = Reader(port)
    try:
        yield reader
    finally:
        reader.close()


@contextmanager
def command_process(folder: Path, *words: str) -> Iterator["subprocess.Popen[str]"]:
    """A command of ours in a process of its own, without a configuration; what it says is in a file there."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("JOINTLAB_")}
    with (folder / "said.txt").open("w") as said:
        command = [sys.executable, "-m", "api.cli", *words]
        with subprocess.Popen(command, cwd=ROOT, env=environment, stderr=said, text=True) as process:
            try:
                yield process
            finally:
                process.terminate()


def expect_state(reader: Reader, lab: Client) -> None:
    """Wait until what is read is what the service says."""
    until(lambda: bool(reader.latest("state") == lab.rig().model_dump(mode="json")))
    until(lambda: bool(reader.latest("availability") == "online"))
