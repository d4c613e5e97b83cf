"""Answers beside truths, and what they add up to."""

import json
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

from analysis.gap.verdict import Status
from jointlab.diagnosis.track_record import record_from
from jointlab.report.trial_figures import confusion
from jointlab.trials.judgement import JUDGEMENT, Judgement, judged
from jointlab.trials.scores import scores
from jointlab.trials.tables import markdown
from simlab.case.draw import Case, CaseKind, draw_case
from simlab.case.simulate import simulate

Make = Callable[..., dict[str, Any]]
EFFECT = "out_of_plane_bending"


class Standing:
    """How far effects stand out, as a test wants it."""

    def __init__(self, case: Case, d: float, beside: float) -> None:
        self.case, self._d, self._beside = case, d, beside

    def of(self, effect: str) -> float:
        return self._d

    def beside(self, named: list[str]) -> float:
        return self._beside


def truth(effects: list[str], novel: list[str] | None = None) -> dict[str, Any]:
    kind = "novel" if novel else {0: "none", 1: "single", 2: "pair"}[len(effects)]
    return {
        "kind": kind,
        "effects": effects,
        "novel": novel or [],
        "size": dict.fromkeys(effects or novel or [], 0.5),
        "parameters": {name: {"law": "a law", "coupling": 0.021} for name in effects},
        "floor_percent": 3.0,
    }


CASE = draw_case(1, CaseKind.SINGLE, [EFFECT])


def judge(answer: dict[str, Any], there: dict[str, Any], d: float = 100.0, beside: float = 50.0) -> Judgement:
    return judged(7, there, answer, Standing(CASE, d, beside))  # type: ignore[arg-type]  # it is asked for case, of and beside alone


def test_the_right_name_is_right_and_its_parameter_is_covered(document: Make) -> None:
    found = judge(document(), truth([EFFECT]))
    assert (found.right, found.inseparable, found.d, found.probability) == (True, True, 100.0, 0.93)
    (coverage,) = found.coverage
    assert (coverage.parameter, coverage.truth, coverage.inside) == ("coupling", 0.021, True)
    assert JUDGEMENT.validate_python(json.loads(json.dumps(asdict(found)))) == found


@pytest.mark.parametrize(("remains", "inseparable"), [(2.0, True), (50.0, False)])
def test_a_wrong_name_is_excused_where_the_data_cannot_speak_against_it(
    document: Make, remains: float, inseparable: bool
) -> None:
    found = judge(document(), truth(["joint_mass"]), beside=remains)
    assert (found.right, found.inseparable) == (False, inseparable)
    assert found.coverage == ()


def test_an_effect_in_no_catalogue_is_to_be_unknown(document: Make) -> None:
    there = truth([], novel=["crack"])
    assert judge(document(status=Status.UNKNOWN, effects=()), there).right
    accepted = judge(document(), there, beside=0.0)
    assert (accepted.right, accepted.inseparable) == (False, False)


def test_nothing_is_to_be_found_where_nothing_is(document: Make) -> None:
    assert judge(document(status=Status.NONE, effects=()), truth([])).right
    assert not judge(document(), truth([])).right


def test_a_pair_is_right_as_a_whole_only(document: Make) -> None:
    assert not judge(document(), truth([EFFECT, "joint_mass"])).right
    assert judge(document(effects=("joint_mass", EFFECT)), truth([EFFECT, "joint_mass"])).right


def test_a_diagnosis_that_failed_is_wrong_and_counted(document: Make) -> None:
    found = judge({"error": "AnalysisError: no", "seconds": 1.0}, truth([EFFECT]))
    assert (found.status, found.right, found.error) == ("failed", False, "AnalysisError: no")
    assert scores([found])["failed"] == ["7: AnalysisError: no"]


def test_the_gap_of_predictions_is_that_on_rows_that_were_never_shown(document: Make) -> None:
    simulated = simulate(CASE)
    lines = simulated.frequency >= 5.0
    rows, asked = [row.name for row in simulated.rows], ["5y", "8y", "2y", "10y"]
    true = simulated.accelerance[0][[rows.index(name) for name in asked]][:, lines]
    predicted = {"frequency": simulated.frequency[lines], "before": 1.1 * true, "after": true, "input": asked}
    found = judge(document() | {"predicted": predicted}, truth([EFFECT]))
    assert found.unseen_percent == pytest.approx(3.0)
    assert found.unseen_before_percent == pytest.approx(np.hypot(10.0, 3.0))


def test_scores_count_what_was_judged(document: Make) -> None:
    every = [
        judge(document(), truth([EFFECT])),
        judge(document(), truth(["joint_mass"])),
        judge(document(), truth(["density"]), d=2.0),
        judge(document(status=Status.NONE, effects=()), truth([])),
        judge(document(), truth([])),
        judge(document(status=Status.UNKNOWN, effects=()), truth([], novel=["crack"])),
        judge(document(effects=("joint_mass", EFFECT)), truth([EFFECT, "joint_mass"])),
    ]
    found = scores(every)
    assert found["top_1"]["detectable"] == {"count": 1, "of": 2, "share": 0.5}
    assert found["top_1"]["by_d"]["below 5"]["count"] == 0
    assert found["false_alarms"]["count"] == 1
    assert found["unknown_rejected"]["share"] == 1.0
    assert found["pairs"]["both"]["share"] == 1.0
    assert found["pairs"]["spurious_second"]["count"] == 0
    assert [each["case"] for each in found["confusions"]] == [7, 7, 7]
    assert found["without_truth"]["share"] is None
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert record_from(found).cases == 7
    said = markdown(found)
    assert "| false alarms | 50.0 % (1 of 2) | at most 2 % |" in said
    assert "| 7 | joint_mass | 0.50 | 100 | explained: out_of_plane_bending | 0.93 | no |" in said


def test_calibration_error_is_the_mean_distance_of_claim_and_truth(document: Make) -> None:
    right, wrong = (judge(document(), truth([name])) for name in (EFFECT, "joint_mass"))
    found = scores([right, right, right, wrong])["calibration"]
    assert found["bins"] == [{"claimed": pytest.approx(0.93), "right": 0.75, "cases": 4}]
    assert found["error"] == pytest.approx(0.18)


def test_what_was_named_for_what_was_there_is_counted_where_it_could_be_told(document: Make) -> None:
    """Pairs are left out, and effects of d below 5; a name that was never there has a column, and no row."""
    there = truth(["joint_mass"])
    every = [
        judge(document(effects=("joint_mass",)), there),
        judge(document(effects=("joint_mass",)), there),
        judge(document(effects=("accelerometer_mass",)), there),
        judge(document(effects=("joint_mass", "accelerometer_mass")), there),
        judge(document(status=Status.NONE, effects=()), there, d=4.0),
        judge(document(status=Status.NONE, effects=()), truth(["joint_mass", EFFECT])),
        judge(document(status=Status.NONE, effects=()), truth([])),
        judge(document(status=Status.UNKNOWN, effects=()), truth([], novel=["crack"])),
    ]
    found = scores(every)["confusion"]
    assert found["there"] == ["joint_mass", "none", "in no catalogue"]
    assert found["named"] == ["accelerometer_mass", "joint_mass", "none", "unknown", "two effects"]
    assert found["counts"] == [[1, 2, 0, 0, 1], [0, 0, 1, 0, 0], [0, 0, 0, 1, 0]]
    assert confusion(found).startswith("<svg")


def test_a_trial_of_nothing_has_no_shares_and_empty_pictures() -> None:
    assert "<svg" in confusion(scores([])["confusion"])
    assert scores([])["top_1"]["all"]["share"] is None
    assert "none tried" in markdown(scores([]))
