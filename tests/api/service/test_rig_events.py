"""Events of the rig over REST: as the schema says, with the values of what was measured."""

import json
from typing import Any

import httpx
import pytest

from analysis.direct.dynamic_stiffness import dynamic_stiffness
from api.service.rig_events import described_events, model_of
from jointlab.client import Client
from jointlab.client.connection import RigEvent
from jointlab.drive.events import EVENTS
from jointlab.supervision.manager import RunManager
from rig.sequences.sequence import DISPLACEMENT, FORCE
from store.catalogue import Catalogue
from store.measurements.sine_records import list_sine_records
from tests.api.conftest import paper

STEPS = [
    {"step": "hammer", "points": ["5y"], "blows": 2, "block_seconds": 1.0},
    {
        "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [0.1],
        "frequencies": {"first": 40, "last": 120, "step": 80},
    },
]  # fmt: skip
KINDS = EVENTS


@pytest.fixture
def told(rig_client: httpx.Client, rig: RunManager) -> list[RigEvent]:
    """What a client hears of a small run."""
    heard: list[RigEvent] = []
    with Client(str(rig_client.base_url)) as lab:
        run = lab.create_run(paper() | {"steps": STEPS})
        with lab.events() as events, lab.driving("test") as driver:
            driver.start(run.id, automatic=True)
            for event in events:
                heard.append(event)
                if event.name == "RunEnded":
                    return heard
    raise AssertionError("the events ended before the run did")


def test_every_event_is_as_the_schema_says(told: list[RigEvent]) -> None:
    for event in told:
        model = model_of(KINDS[event.name])
        data = {"at": event.at.isoformat(), **event.data}
        assert set(data) == set(model.model_fields), event.name
        model.model_validate_json(json.dumps(data), strict=True)


def test_a_sine_point_that_was_measured_is_told_with_its_values(told: list[RigEvent], catalogue: Catalogue) -> None:
    points = [event.data for event in told if event.name == "SinePointMeasured"]
    with catalogue.reading() as session:
        records = list_sine_records(session, 1)
    assert [(point["frequency"], point["reached_pp_mm"]) for point in points] == [
        (record.frequency, record.reached_pp_mm) for record in records
    ]
    for point, record in zip(points, records, strict=True):
        assert record.waveform is not None
        waveform = catalogue.waveforms.read(record.waveform)
        signals = waveform.value(DISPLACEMENT), waveform.value(FORCE)
        found = dynamic_stiffness(*signals, waveform.sample_rate, record.frequency)
        for name, estimate in (("stiffness", found.stiffness_estimate), ("loss_factor", found.loss_factor_estimate)):
            assert point[name] == pytest.approx(estimate.value, abs=0.1 * estimate.standard_error)
        assert point["stiffness"] > 1e4  # N/m, of joint I in shear


def test_a_blow_is_told_with_its_verdict(told: list[RigEvent]) -> None:
    accepted = [event.data for event in told if event.name == "BlowAccepted"]
    assert [(blow["point"], blow["accepted"], blow["wanted"]) for blow in accepted] == [("5y", 1, 2), ("5y", 2, 2)]
    assert all(blow["peak_force"] > 30 for blow in accepted)


def test_every_quantity_of_an_event_has_its_unit() -> None:
    stream: dict[str, Any] = described_events()["content"]["text/event-stream"]["itemSchema"]
    missing = [
        f"{kind['title']}.{field}"
        for kind in stream["oneOf"]
        for field, about in kind["properties"]["data"]["contentSchema"]["properties"].items()
        if '"type": "number"' in json.dumps(about) and "x-unit" not in about
    ]
    assert len(stream["oneOf"]) == len(EVENTS) > 20
    assert missing == []
