"""The document that other people's programs read, held to the contract."""

import json
from collections.abc import Callable
from typing import Any

import pytest

from analysis.gap.diagnosis import Diagnosis
from analysis.gap.evidence.verdict import Status
from analysis.gap.findings.effects_found import Remainder
from analysis.gap.fitting.held_out import HeldOut
from jointlab.diagnosis.document import diagnosis_document, probability
from jointlab.diagnosis.track_record import TrackRecord, TrialVerdict, strength
from tests.jointlab.diagnosis.conftest import CURVE, FOLLOWS_AMPLITUDE

Make = Callable[..., dict[str, Any]]


def test_the_document_is_as_the_contract_has_it(document: Make) -> None:
    found = document()
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert found["format"] == "jointlab-diagnosis/1"
    assert found["gap"]["before"] == {"percent": 12.3, "sigma": 41.0}
    assert found["gap"]["after"] == {"percent": 3.1, "sigma": 1.2}
    assert found["gap"]["after_ci90_percent"] == pytest.approx([2.79, 3.41])
    assert found["gap"]["floor_percent"] == 2.9
    assert found["gap"]["held_out"] is True
    assert found["gap"]["by_rig"]["inverse"].items() >= {"before": 12.3, "after": 3.1}.items()
    assert found["gap"]["by_rig"]["direct"].items() >= {"before": 6.15, "after": 1.55}.items()
    place = {"rig": "inverse", "input": "1x", "response": "3y", "band_hz": [300.0, 360.0], "level": 1}
    assert found["where"][0].items() >= (place | {"part": "magnitude", "share": 0.41}).items()
    first = found["ranking"][0]
    assert first["effects"] == ["out_of_plane_bending"]
    assert first["probability"] == 0.93
    assert first["held_out_gap_percent"] == 3.1
    parameters = {"out_of_plane_bending": {"coupling": {"value": 0.02, "ci90": [0.018, 0.022], "unit": "1"}}}
    assert first["parameters"] == parameters
    assert [each["effects"] for each in found["ranking"][1:]] == [[], ["unknown"]]
    assert found["verdict"] == {
        "status": "explained",
        "effects": ["out_of_plane_bending"],
        "twins": [["impact_angle", "cross_axis_sensitivity"]],
        "next_experiment": (
            "turn the accelerometer, or use one of three axes: expected to confirm out_of_plane_bending, 90 % of "
            "the uncertainty removed in 20 min"
        ),
        "experiment": {
            "id": "turn_accelerometer",
            "effects": ["out_of_plane_bending"],
            "tells_apart": False,
            "information": 0.9,
            "doubt": 1.0,
            "minutes": 20.0,
            "corrections": [],
        },
    }
    (effect,) = found["effects"]
    assert effect.items() >= {"id": "out_of_plane_bending", "probability": 0.93, "law_is_known": True}.items()
    assert effect["parameters"] == parameters["out_of_plane_bending"]
    assert found["mechanisms"] == [{"mechanism": "beam", "probability": 0.93}]
    assert found["remainder"] == {"percent": 1.1, "sigma": 0.9, "significant": False, "where": []}
    assert found["nuisances"] == {
        "setup_scatter": 0.004,
        "configuration_gain": 0.011,
        "model_error": 0.002,
        "blow_lean": 0.005,
    }
    assert found["seconds"] == 12.0


def test_the_shape_of_what_is_left_has_both_parts_with_their_bands(document: Make) -> None:
    curve = document(remainder=Remainder(9.0, 40.0, True, (), curve=CURVE))["remainder"]["curve"]
    assert curve["place"] == CURVE.place
    assert curve["gap_percent"] == {"before": 12.3, "after": 3.4}
    assert (curve["over"], curve["unit"], curve["resembles"]) == ("frequency", "N/m", "dashpot")
    for name in ("real", "imaginary"):
        low, high = curve[f"{name}_ci90"]
        assert len(low) == len(high) == len(curve[name]) == len(curve["at"])
        assert all(a < value < b for a, value, b in zip(low, curve[name], high, strict=True))


def test_a_law_of_the_joints_is_given_along_both_axes_with_its_band(document: Make) -> None:
    found = document(included=(FOLLOWS_AMPLITUDE,))
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    (effect,) = found["effects"]
    law = effect["law_found"]
    assert (law["over"], law["unit"], law["closest_law"]) == ("amplitude", "m", "Kraus")
    assert law["at"] == [1e-6, 3e-6, 10e-6]
    assert law["compression"]["stiffness"]["value"] == [1.0, 0.9, 0.8]
    for axis in ("compression", "shear"):
        for quantity in ("stiffness", "loss_factor", "loss_ratio"):
            low, high = law[axis][quantity]["ci90"]
            assert all(a <= value <= b for a, value, b in zip(low, law[axis][quantity]["value"], high, strict=True))
    assert document()["effects"][0]["law_found"] is None


def test_a_rig_that_was_not_measured_with_is_not_there(diagnosis: Callable[..., Diagnosis]) -> None:
    def beam_only(held_out: HeldOut) -> HeldOut:
        return HeldOut(held_out.inverse, None, held_out.ci90_percent)

    whole = diagnosis()
    found = diagnosis_document(diagnosis(before=beam_only(whole.before), after=beam_only(whole.after)), TrackRecord())
    assert set(found["gap"]["by_rig"]) == {"inverse"}


def test_numbers_that_are_not_known_are_null(document: Make) -> None:
    assert document(floor_percent=float("nan"))["gap"]["floor_percent"] is None
    assert document()["ranking"][2]["held_out_gap_percent"] is None


def test_the_probability_of_a_verdict_is_that_of_its_own_entry(document: Make) -> None:
    assert probability(document()) == 0.93
    assert probability(document(status=Status.NONE, effects=())) == 0.04
    assert probability(document(status=Status.UNKNOWN, effects=())) == 0.03


def verdict(
    effect: str, probability: float, right: bool, strong: str = "strong", status: str = "explained"
) -> TrialVerdict:
    return TrialVerdict(status, (effect,) if effect else (), strong, probability, right)


RECORD = TrackRecord(
    40,
    (
        verdict("out_of_plane_bending", 0.95, True),
        verdict("out_of_plane_bending", 0.6, False),
        verdict("out_of_plane_bending", 0.9, True, "clear"),
        verdict("joint_mass", 0.9, True),
        verdict("", 0.99, True, "faint", "none"),
    ),
    ("version 7",),
)


def test_beside_a_verdict_stands_how_often_the_like_was_right(document: Make) -> None:
    trial = document(RECORD)["trial"]
    assert trial == {
        "cases": 40,
        "versions": ["version 7"],
        "strength": "strong",
        "named": 2,
        "right": 1,
        "confidence": {"named": 1, "right": 0},
    }
    assert probability(document(RECORD)) == pytest.approx(4 / 6), "three of four that named an effect were right"


def test_pairs_are_compared_with_pairs_and_none_with_none() -> None:
    pair = RECORD.similar("explained", ("a", "b"), "strong", 0.9)
    assert pair is not None
    assert pair["named"] == 0
    none = RECORD.similar("none", (), "faint", 1.0)
    assert none is not None
    assert (none["named"], none["right"]) == (1, 1)


def test_without_a_trial_there_is_no_score(document: Make) -> None:
    assert document()["trial"] is None


def test_the_strength_of_a_gap_is_that_of_the_rig_where_it_is_larger(document: Make) -> None:
    found = document()
    assert strength(found) == "strong"
    found["gap"]["by_rig"]["inverse"]["before_sigma"] = 1.1
    found["gap"]["by_rig"]["direct"]["before_sigma"] = 3.0
    assert strength(found) == "clear"
    found["gap"]["by_rig"]["direct"]["before_sigma"] = None
    assert strength(found) == "faint"
