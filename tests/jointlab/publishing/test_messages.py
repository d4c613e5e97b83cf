"""Which topic has what, and in which form."""

import json
from datetime import UTC, datetime

import pytest

from jointlab.client.connection import RigEvent
from jointlab.documents.rig import RigDocument
from jointlab.drive.events import EVENTS
from jointlab.drive.phase import Phase
from jointlab.publishing.messages import (
    alarms_message,
    availability_message,
    base_topic,
    event_message,
    results_message,
    state_message,
)

BASE = base_topic("laboratory/hall 2", "B2")
IDLE = RigDocument(
    phase=Phase.IDLE, run_id=None, title="", activity="", point=None, blows=0, blows_wanted=0, sines=0, sines_wanted=0,
    ended_as=None, reason=None, pressure=None, interlocks=[], tripped=False, tester_silent=None, rest_unknown=None,
    is_driven=True, pause=None, stop_epoch=1, prompt=None, stop=None, driven_by="Zoë", latest_event=3,
)  # fmt: skip


def test_documents_are_retained_and_events_are_not() -> None:
    event = RigEvent("a-4", "StopLatched", datetime(2026, 1, 31, tzinfo=UTC), {"who": "Zoë", "why": "smoke"})
    told = event_message(BASE, event)
    assert (told.topic, told.retained) == ("laboratory/hall 2/B2/events/StopLatched", False)
    assert json.loads(told.payload) == {
        "id": "a-4", "event": "StopLatched", "at": "2026-01-31T00:00:00Z", "data": {"who": "Zoë", "why": "smoke"}
    }  # fmt: skip
    state = state_message(BASE, IDLE)
    assert (state.topic, state.retained) == ("laboratory/hall 2/B2/state", True)
    assert RigDocument.model_validate_json(state.payload) == IDLE
    for message, name in ((alarms_message(BASE, []), "alarms"), (results_message(BASE, []), "results")):
        assert (message.topic, message.payload, message.retained) == (f"laboratory/hall 2/B2/{name}", b"[]", True)


def test_availability_is_one_word() -> None:
    found = [availability_message(BASE, answers=answers).payload for answers in (True, False)]
    assert found == [b"online", b"offline"]


@pytest.mark.parametrize("name", EVENTS)
def test_every_kind_of_event_is_one_level_of_a_topic(name: str) -> None:
    event = RigEvent("a-1", name, datetime.now(UTC), {})
    assert event_message(BASE, event).topic.split("/")[-2:] == ["events", name]
    assert not set("+#/") & set(name)
