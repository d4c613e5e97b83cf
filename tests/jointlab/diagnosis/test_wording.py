"""What a technician reads."""

from collections.abc import Callable
from typing import Any

import pytest

from analysis.gap.evidence.verdict import Status
from analysis.gap.findings.effects_found import LocalFinding, Remainder
from analysis.gap.findings.location import GapPlace
from analysis.gap.findings.set_up_changes import SetUpChange
from analysis.gap.measurement import Rig
from analysis.gap.parameter import ParameterEstimate
from jointlab.diagnosis import wording
from jointlab.diagnosis.track_record import TrackRecord, TrialVerdict
from jointlab.report.gap_tables import effects_table, ranking_table
from tests.jointlab.diagnosis.conftest import CURVE

Make = Callable[..., dict[str, Any]]


def test_an_explained_gap_says_what_to_add_and_how_far_the_gap_falls(document: Make) -> None:
    said = wording.verdict_sentence(document())
    assert said.startswith("add ")
    assert said.endswith("(out_of_plane_bending): the gap falls from 12.3 % to 3.1 % [2.8, 3.4], floor 2.9 %")


@pytest.mark.parametrize(
    ("status", "said"),
    [
        (Status.NONE, "nothing beyond noise and stated tolerances: the gap is 12.3 % [2.8, 3.4], floor 2.9 %"),
        (Status.UNKNOWN, "a gap of 12.3 %, floor 2.9 %, most of which no effect that was tried explains"),
    ],
)
def test_nothing_is_named_where_nothing_is_known(document: Make, status: Status, said: str) -> None:
    assert wording.verdict_sentence(document(status=status, effects=())).startswith(said)


def test_what_remains_is_said(document: Make) -> None:
    assert "something remains" in wording.verdict_sentence(document(status=Status.PARTIAL))


def test_a_probability_stands_beside_the_trial(document: Make) -> None:
    assert wording.probability_sentence(document()) == "probability 93 %; this catalogue has no published trial yet"
    like = TrialVerdict("explained", ("out_of_plane_bending",), "strong", 0.95, True)
    said = wording.probability_sentence(document(TrackRecord(7, (like,))))
    assert "in sealed trials of 7 cases (software: an unknown version) this verdict at a strong" in said
    assert "was right 1 of 1 times" in said
    by_many = TrackRecord(7, (like,), versions=("0.1", "0.2", "0.3"))
    assert "7 cases (by 3 versions of the software) this" in wording.probability_sentence(document(by_many))
    other = TrialVerdict("explained", ("joint_mass",), "strong", 0.5, True)
    assert "none had this verdict" in wording.probability_sentence(document(TrackRecord(7, (other,))))


def test_places_in_both_rigs_are_named(document: Make) -> None:
    beam, tester = document()["where"]
    assert wording.place_words(beam) == "beam rig, blow at 1x, set 1"
    assert wording.band_words(beam) == "300 to 360 Hz"
    assert wording.place_words(tester) == "elastomer tester, I, shear, 0.1 mm"


def test_places_at_another_rig_than_the_cause_are_no_contradiction(document: Make) -> None:
    found = document()
    plain = wording.places_caption(found)
    assert plain == "Places where the model without any effect misses, the largest share of the misfit first"
    found["where"] = [place for place in found["where"] if place["rig"] == "direct"]
    assert wording.places_caption(found) == (
        f"{plain}. The cause is at the beam rig: through the joints, a model without it takes its error to the "
        "elastomer tester"
    )
    assert wording.places_caption(found | {"effects": []}) == plain


def test_parameters_are_those_of_the_verdict(document: Make) -> None:
    assert wording.parameter_lines(document()) == [
        (
            "bending out of plane",
            "coupling of the bending out of the plane (coupling)",
            "0.02",
            "0.018 … 0.022",
        )
    ]
    assert wording.parameter_lines(document(status=Status.UNKNOWN, effects=())) == []


def test_confounded_effects_are_listed(document: Make) -> None:
    said = wording.confounded_sentence(document())
    assert said == "these data cannot tell apart: blows that lean, cross-axis sensitivity of the accelerometer"
    assert wording.confounded_sentence(document(confounded=())) == ""


def test_beside_the_verdict_stand_both_rigs_the_mechanism_and_the_remainder(document: Make) -> None:
    found = document()
    assert wording.rigs_sentence(found) == (
        "gap on held-out data: beam rig 12.3 % to 3.1 %, elastomer tester 6.2 % to 1.6 %"
    )
    mechanism, remainder, nuisances = wording.beside(found)
    assert mechanism == "mechanism: the beam and what rides on it (93 %)"
    assert remainder.startswith("remainder: no more than measuring again would show (1.1 % of the response")
    assert nuisances.startswith(
        "estimated scatter, besides the effects: joints from one set-up to the next 0.4 %, the tester"
    )
    assert nuisances.endswith("smooth error of accelerances 0.2 %, blows that lean from point to point 0.29 degrees")


def test_a_joint_that_differs_between_sets_is_told_with_its_sets_and_what_to_do(document: Make) -> None:
    found = document(set_up_changes=(SetUpChange("I", 3, 1, 6.04, 0.21),))
    assert found["set_up_changes"][0]["stiffest"] == 1
    assert wording.beside(found)[-1] == (
        "joint I was 6 % stiffer in set 1 than in set 3 (standard error 0.2 %), more than set-ups usually make; look "
        "at its mounting, and at what happened between these sets"
    )
    assert wording.set_up_sentences({}) == []  # of an earlier version


def test_a_remainder_beyond_noise_is_said_with_its_place(document: Make) -> None:
    place = GapPlace(Rig.BEAM, {"input": "1x", "response": "3y", "level": 1}, (300.0, 360.0), "magnitude", 0.41, 88.0)
    found = document(remainder=Remainder(2.0, 3.0, True, (place,)))
    said = wording.remainder_sentence(found)
    assert "more than noise; most at beam rig, blow at 1x, set 1, 300 to 360 Hz" in said


def test_a_parameter_beyond_its_range_and_a_law_that_is_not_known_are_said(document: Make) -> None:
    (effect,) = document()["effects"]
    assert wording.law_words(effect) == "two modes"
    beyond = effect | {"out_of_range": ["coupling"], "law_is_known": False, "law": "smooth function"}
    said = wording.law_words(beyond)
    assert said == "no known law fits; as found: smooth function; beyond its plausible range: coupling"


def test_a_cause_in_no_catalogue_is_said_with_its_place(document: Make) -> None:
    at = LocalFinding(
        "a mass on a spring",
        {"m": ParameterEstimate(0.08, (0.07, 0.09), "kg"), "position": ParameterEstimate(0.37, (0.36, 0.38), "m")},
    )
    (said,) = [
        each for each in wording.beside(document(remainder=Remainder(9.0, 40.0, True, (), at))) if "remainder" in each
    ]
    assert said.endswith("It acts like a mass on a spring at 0.370 m from the left end (m 0.0800 kg)")


LATER = {"effects", "mechanisms", "remainder", "nuisances"}


def test_diagnoses_of_earlier_versions_have_nothing_beside_their_verdict(document: Make) -> None:
    earlier = {name: each for name, each in document().items() if name not in LATER}
    assert wording.beside(earlier) == []


def test_what_would_take_up_the_rest_is_said_with_place_gap_and_likeness(document: Make) -> None:
    found = document(remainder=Remainder(9.0, 40.0, True, (), curve=CURVE))
    said = (
        "a smooth function that would explain most of it: dynamic stiffness at 0.056 m (joint I), across the beam, "
        "over frequency: 12.3 % to 3.4 % on held-out data; it resembles: dashpot"
    )
    assert said in wording.beside(found)
    assert wording.shape_sentence(document()) == ""


@pytest.mark.parametrize(
    ("place", "title"),
    [
        ({"rig": "inverse", "at": "channel"}, "of the accelerometer over the hammer, over frequency"),
        ({"rig": "inverse", "at": "channel", "set": 2}, "of the accelerometer over the hammer, set 2, over frequency"),
        ({"rig": "inverse", "at": "joint II"}, "of joint II, over frequency"),
        ({"rig": "direct", "at": "tester", "configuration": "shear"}, "of the tester, shear, over frequency"),
    ],
)
def test_a_function_of_a_reading_names_its_instrument(place: dict[str, Any], title: str) -> None:
    curve = {"quantity": "relative change of the reading", "over": "frequency", "place": place}
    assert wording.shape_title(curve) == f"relative change of the reading {title}"


def test_people_read_titles_where_data_have_ids(document: Make) -> None:
    found = document()
    effects = effects_table(found)
    assert effects is not None
    assert [row[0] for row in effects.rows] == ["bending out of plane"]
    names = [str(row[0]) for row in ranking_table(found).rows]
    assert names[0] == "bending out of plane"
    assert not any("_" in name for name in names)
    assert wording.ranked_name(["out_of_plane_bending"]) == "out_of_plane_bending"


def test_the_next_experiment_names_effects_by_their_titles(document: Make) -> None:
    found = document()
    assert ": expected to confirm bending out of plane, 90 % of the uncertainty" in wording.next_experiment_words(found)
    older = found | {"verdict": {"next_experiment": "weigh the accelerometer"}}
    assert wording.next_experiment_words(older) == "weigh the accelerometer"
