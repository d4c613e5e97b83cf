"""The connection to a broker of MQTT, which comes back by itself. It subscribes to nothing, so nothing is received."""

import logging
import threading
from hashlib import sha256
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from jointlab.errors import JointlabError
from jointlab.publishing.messages import Message
from jointlab.publishing.settings import MQTT_PASSWORD, MqttSettings
from store.extras import explained_imports

if TYPE_CHECKING:
    from paho.mqtt.client import Client

log = logging.getLogger(__name__)

KEEPALIVE = 15
"""Seconds after which the connection is tried; a broker says "offline" after one and a half times as long."""
PATIENCE = 10.0
"""Seconds that the broker may take to answer at the start, and to take the last message."""
FIRST_PAUSE, LONGEST_PAUSE = 1, 30
"""Seconds before the connection is tried again; each further pause is twice as long."""


class Broker:
    """A connection to a broker. A context manager: it says its last will also where it is left in order.

    Args:
        settings: its address, and who logs in.
        password: of the user.
        base: what all topics begin with; two programs that publish the same topics do not stay connected.
        last_will: what the broker says when the connection is lost.
    """

    def __init__(self, settings: MqttSettings, password: str | None, base: str, last_will: Message) -> None:
        self._settings = settings
        self._last_will = last_will
        self._changed = threading.Condition()
        self._acknowledged = set[int]()
        self._connected = False
        self._refusal: str | None = None
        self._connections = 0
        self._client = _client(base)
        self._client.will_set(last_will.topic, last_will.payload, qos=1, retain=last_will.retained)
        if settings.is_encrypted:
            self._client.tls_set()
        if settings.user is not None:
            self._client.username_pw_set(settings.user, password)
        self._client.reconnect_delay_set(FIRST_PAUSE, LONGEST_PAUSE)
        self._client.on_connect = self._on_connect
        self._client.on_disconnect = self._on_disconnect
        self._client.on_publish = self._on_publish

    def __enter__(self) -> Self:
        """Connect.

        Raises:
            JointlabError: no broker answers there, or it refuses; the message says what to change.
        """
        address = self._settings.broker
        try:
            self._client.connect(self._settings.host, self._settings.port, KEEPALIVE)
        except (OSError, ValueError) as error:
            raise JointlabError(f"no MQTT broker answers at {address} ({error}); correct its address") from error
        self._client.loop_start()
        with self._changed:
            self._changed.wait_for(lambda: self._connected or self._refusal is not None, PATIENCE)
            connected, refusal = self._connected, self._refusal
        if not connected:
            self._client.disconnect()
            self._client.loop_stop()
            why = refusal or f"no answer within {PATIENCE:g} s"
            raise JointlabError(
                f"the MQTT broker at {address} does not take the connection ({why}); correct address, user or "
                f"{MQTT_PASSWORD}"
            )
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        will = self._last_will
        if self._connected:
            number = self._client.publish(will.topic, will.payload, qos=1, retain=will.retained).mid
            with self._changed:
                self._changed.wait_for(lambda: number in self._acknowledged, PATIENCE)
        self._client.disconnect()
        self._client.loop_stop()

    @property
    def connections(self) -> int:
        """How often the connection was made. What the broker retains may be gone with each."""
        return self._connections

    def deliver(self, message: Message) -> None:
        """Publish a message, and wait until the broker has acknowledged it, also where it is away meanwhile.

        So there is one message at a time of each thread, in order, and nothing else waits in memory.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._connected)
        number = self._client.publish(message.topic, message.payload, qos=1, retain=message.retained).mid
        with self._changed:
            self._changed.wait_for(lambda: number in self._acknowledged)
            self._acknowledged.discard(number)

    def _on_connect(self, _client: object, _data: object, _flags: object, reason: Any, _properties: object) -> None:
        if reason.is_failure:
            log.warning("the broker refuses the connection: %s", reason)
        else:
            log.info("the broker at %s is there", self._settings.broker)
        with self._changed:
            self._connected = not reason.is_failure
            self._refusal = str(reason) if reason.is_failure else None
            self._connections += self._connected
            self._changed.notify_all()

    def _on_disconnect(self, _client: object, _data: object, _flags: object, reason: Any, _properties: object) -> None:
        if reason.is_failure:
            log.warning("the broker has gone (%s); waiting for it", reason)
        with self._changed:
            self._connected = False
            self._refusal = self._refusal or str(reason)
            self._changed.notify_all()

    def _on_publish(self, _client: object, _data: object, number: int, _reason: object, _properties: object) -> None:
        with self._changed:
            self._acknowledged.add(number)
            self._changed.notify_all()


def _client(base: str) -> "Client":
    """A client whose name follows from its topics, so that a new connection ends an old one that hangs, and its will.

    Names of up to 23 characters are those that every broker takes.
    """
    with explained_imports():
        from paho.mqtt.client import Client
        from paho.mqtt.enums import CallbackAPIVersion
    return Client(CallbackAPIVersion.VERSION2, client_id=f"jointlab-{sha256(base.encode()).hexdigest()[:12]}")
