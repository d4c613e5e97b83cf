"""Labelled bundles are diagnosed as what they are: an effect of each rig, and one that is in no catalogue.

About 40 s of one core; the other bundles are for trials by hand.
"""

import json
from typing import Any

import pytest

from jointlab.diagnosis.pipeline import diagnose_bundle
from tests.recordings import Recording

EXAMPLES = ("sensor_mass", "delay")


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_effect_of_an_example_is_named_and_the_gap_falls_to_its_floor(recording: Recording, name: str) -> None:
    truth: dict[str, Any] = json.loads(recording(f"examples/truth/{name}.json").read_text(encoding="utf-8"))
    found = diagnose_bundle(recording(f"examples/{name}"))
    verdict, gap = found.document["verdict"], found.document["gap"]
    assert verdict["status"] == "explained"
    assert verdict["effects"] == truth["effects"]
    assert gap["before"]["sigma"] > gap["after"]["sigma"]
    assert gap["before"]["percent"] >= gap["after"]["percent"]  # alike where both are at the floor there
    assert gap["after"]["percent"] < 1.2 * truth["floor_percent"]
    assert sum(each["probability"] for each in found.document["ranking"]) == pytest.approx(1.0)
    for effect in truth["effects"]:
        (parameter,) = found.document["ranking"][0]["parameters"][effect].items()
        name_of, estimate = parameter
        low, high = estimate["ci90"]
        half = (high - low) / 2
        # a 90 % interval may miss now and then, but not by more than its own width
        assert low - half < truth["parameters"][effect][name_of] < high + half
