"""Messages for a broker of MQTT: which topic has what, and in which form. No input or output."""

from collections.abc import Sequence
from dataclasses import dataclass

from pydantic import BaseModel, TypeAdapter

from jointlab.client.connection import RigEvent
from jointlab.documents.alarms import AlarmDocument
from jointlab.documents.results import AnalysisDocument
from jointlab.documents.rig import RigDocument

ONLINE, OFFLINE = b"online", b"offline"


@dataclass(frozen=True)
class Message:
    """A message to be published.

    Attributes:
        topic: in full.
        payload: JSON in UTF-8; of availability one word.
        retained: whether the broker keeps it for those who subscribe later.
    """

    topic: str
    payload: bytes
    retained: bool


def availability_message(base: str, *, answers: bool) -> Message:
    """Whether what is published of a rig is true at present; `base` is the prefix and the rig's name."""
    return Message(f"{base}/availability", ONLINE if answers else OFFLINE, retained=True)


def state_message(base: str, rig: RigDocument) -> Message:
    """The state of a rig."""
    return Message(f"{base}/state", rig.model_dump_json().encode(), retained=True)


def alarms_message(base: str, alarms: Sequence[AlarmDocument]) -> Message:
    """The alarms that nobody has acknowledged."""
    return Message(f"{base}/alarms", _listed(alarms), retained=True)


def results_message(base: str, results: Sequence[AnalysisDocument]) -> Message:
    """The results of the run that is carried out, or was last."""
    return Message(f"{base}/results", _listed(results), retained=True)


def event_message(base: str, event: RigEvent) -> Message:
    """An event, on a topic of its kind; its `id` tells a reader one that comes twice, and one that is missing."""
    payload = {"id": event.id, "event": event.name, "at": event.at, "data": event.data}
    return Message(f"{base}/events/{event.name}", _JSON.dump_json(payload), retained=False)


def base_topic(prefix: str, rig: str) -> str:
    """What every topic of a rig begins with."""
    return f"{prefix}/{rig}"


_JSON = TypeAdapter[object](object)


def _listed(documents: Sequence[BaseModel]) -> bytes:
    return _JSON.dump_json([each.model_dump(mode="json") for each in documents])
