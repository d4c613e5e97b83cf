"""What a rig does, published to a broker of MQTT: retained documents in one thread, events in another."""

import logging
import threading
import time
from contextlib import closing
from typing import NoReturn, Protocol

from jointlab.background import in_background
from jointlab.client.connection import RigEvent
from jointlab.publishing.broker import Broker
from jointlab.publishing.messages import (
    Message,
    alarms_message,
    availability_message,
    base_topic,
    event_message,
    results_message,
    state_message,
)
from jointlab.publishing.service import Service, ServiceAwayError, answering_at_the_start
from jointlab.publishing.settings import MqttSettings

log = logging.getLogger(__name__)

STATE_INTERVAL = 2.0
"""Seconds after which the state is asked for where no event comes."""
SHORTEST = 0.2
"""Seconds between two requests for the state at least, however many events come: the rig has other work."""
LIST_INTERVAL = 5.0
"""Seconds between two requests for alarms and results."""
REPETITION = 30.0
"""Seconds after which all documents are published again: another client, or a late last will, may have replaced one."""


def publish(settings: MqttSettings, password: str | None, rig: str, service: str, key: str | None) -> NoReturn:
    """Publish what a rig does until the program is ended.

    Args:
        settings: of the broker.
        password: of the user of the broker.
        rig: its name, as the service has it in alarms.
        service: its address.
        key: of the service.

    Raises:
        JointlabError: service or broker cannot be used when it begins. Later it waits for both.
    """
    base = base_topic(settings.prefix, rig)
    broker = Broker(settings, password, base, availability_message(base, answers=False))
    with closing(Service(service, key)) as asked, closing(Service(service, key)) as followed:
        with answering_at_the_start():
            after = followed.latest_event()
        with broker:
            happened = threading.Event()

            def tell(event: RigEvent) -> None:
                broker.deliver(event_message(base, event))
                happened.set()

            events = in_background(lambda: followed.follow(after, tell))
            documents = _Documents(asked, broker, base, rig)
            while not events.done():
                documents.publish()
                happened.wait(STATE_INTERVAL)
                happened.clear()
                time.sleep(SHORTEST)
            events.result()
            raise AssertionError("events are followed until an error")


class _Publisher(Protocol):
    """What documents are published to: a broker."""

    @property
    def connections(self) -> int: ...

    def deliver(self, message: Message) -> None: ...


class _Documents:
    """The retained documents, each published where it is not what the broker has."""

    def __init__(self, service: Service, broker: _Publisher, base: str, rig: str) -> None:
        self._service = service
        self._broker = broker
        self._base = base
        self._rig = rig
        self._shown: dict[str, bytes] = {}
        self._shown_since = 0.0
        self._connection = 0
        self._listed_at = float("-inf")
        self._trouble: str | None = None

    def publish(self) -> None:
        """Ask the service, and publish what has changed; last whether it answers."""
        try:
            rig = self._service.rig()
        except ServiceAwayError as away:
            self._say(f"the service is away: {away}")
            self._show(availability_message(self._base, answers=False))
            return
        self._show(state_message(self._base, rig))
        self._show(availability_message(self._base, answers=True))
        if time.monotonic() >= self._listed_at + LIST_INTERVAL:
            self._publish_lists(rig.run_id)
            self._listed_at = time.monotonic()

    def _publish_lists(self, run: int | None) -> None:
        try:
            alarms = self._service.standing_alarms(self._rig)
            results = [] if run is None else self._service.results(run)
        except ServiceAwayError as away:  # as where its database is away; the state of the rig is told all the same
            self._say(f"no alarms and results: {away}")
            return
        self._say(None)
        self._show(alarms_message(self._base, alarms))
        self._show(results_message(self._base, results))

    def _show(self, message: Message) -> None:
        now = time.monotonic()
        if self._broker.connections != self._connection or now >= self._shown_since + REPETITION:
            self._shown.clear()
            self._shown_since = now
            self._connection = self._broker.connections
            self._listed_at = float("-inf")
        if self._shown.get(message.topic) != message.payload:
            self._broker.deliver(message)
            self._shown[message.topic] = message.payload

    def _say(self, trouble: str | None) -> None:
        """Log what is wrong, once, and when it is over."""
        if trouble != self._trouble:
            if trouble is None:
                log.info("the service answers again")
            else:
                log.warning("%s", trouble)
            self._trouble = trouble
