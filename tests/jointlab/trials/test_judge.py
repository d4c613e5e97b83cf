"""Answers beside opened seals: what is excused, and what was predicted of rows never shown."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from analysis.gap.evidence.verdict import Status
from jointlab.diagnosis.track_record import record_from
from jointlab.report.trial_figures import confusion, reliability
from jointlab.trials.judge import judged
from jointlab.trials.marks import Mark
from jointlab.trials.summary import calibration, markdown, summary
from simlab.case.draw import Case, CaseKind, draw_case
from simlab.case.simulate import simulate

Make = Callable[..., dict[str, Any]]
EFFECT = "out_of_plane_bending"
CASE = draw_case(1, CaseKind.SINGLE, [EFFECT])


class Standing:
    """How far effects stand out, as a test wants it."""

    def __init__(self, case: Case, d: float, beside: float) -> None:
        self.case, self._d, self._beside = case, d, beside

    def of(self, _effect: str) -> float:
        return self._d

    def beside(self, _named: Sequence[str]) -> float:
        return self._beside


def truth(effects: list[str], novel: list[str] | None = None) -> dict[str, Any]:
    return {
        "seed": 7,
        "kind": "novel" if novel else {0: "none", 1: "single", 2: "pair"}[len(effects)],
        "effects": effects,
        "novel": novel or [],
        "size": dict.fromkeys(effects or novel or [], 0.5),
        "parameters": {name: {"law": "a law", "coupling": 0.021} for name in effects},
        "floor_percent": 3.0,
    }


def judge(answer: dict[str, Any], there: dict[str, Any], d: float = 100.0, beside: float = 50.0) -> Mark:
    return judged(there, answer, Standing(CASE, d, beside))  # type: ignore[arg-type]  # it is asked for case, of and beside alone


def test_the_right_name_is_right_and_its_parameter_is_covered(document: Make) -> None:
    found = judge(document(), truth([EFFECT]))
    assert (found.right, found.inseparable, found.truth.d, found.probability) == (True, True, 100.0, 0.93)
    (coverage,) = found.coverage
    assert (coverage.parameter, coverage.truth, coverage.inside) == ("coupling", 0.021, True)


@pytest.mark.parametrize(("remains", "excused"), [(2.0, True), (50.0, False)])
def test_a_wrong_name_is_excused_where_the_data_cannot_speak_against_it(
    document: Make, remains: float, excused: bool
) -> None:
    found = judge(document(), truth(["joint_mass"]), beside=remains)
    assert (found.right, found.inseparable, bool(found.surely_wrong)) == (False, excused, not excused)
    outside = judge(document(), truth([], novel=["crack"]), beside=0.0)
    assert (outside.right, outside.inseparable) == (False, False)


def test_the_gap_of_predictions_is_that_on_rows_that_were_never_shown(document: Make) -> None:
    simulated = simulate(CASE)
    lines = simulated.frequency >= 5.0
    rows, asked = [row.name for row in simulated.rows], ["5y", "8y", "2y", "10y"]
    true = simulated.accelerance[0][[rows.index(name) for name in asked]][:, lines]
    predicted = {"frequency": simulated.frequency[lines], "before": true, "after": 1.1 * true, "input": asked}
    found = judge(document() | {"predicted": predicted}, truth([EFFECT]))
    assert found.unseen == pytest.approx(np.hypot(10.0, 3.0))


def test_the_true_remainder_is_that_of_the_rows_measured(document: Make) -> None:
    """It was the gap on rows never shown, where an effect of one set or of each point is another."""
    simulated = simulate(CASE)
    lines = np.flatnonzero(simulated.frequency >= 5.0)
    number, row, line = map(np.ravel, np.meshgrid([0, 1], [0, 3], lines, indexing="ij"))
    true = simulated.accelerance[number, row, line]
    fitted = {
        "set": number,
        "input": np.array([simulated.rows[each].name for each in row]),
        "frequency": simulated.frequency[line],
        "accelerance": np.where(number == 1, 1.1 * true, true),
    }
    found = judge(document() | {"fitted": fitted}, truth([EFFECT]))
    of_second = np.sum(np.abs(true[number == 1]) ** 2) / np.sum(np.abs(true) ** 2)
    assert found.truth.remainder_percent == pytest.approx(10.0 * np.sqrt(of_second))
    assert judge(document(), truth([EFFECT])).truth.remainder_percent is None


def test_the_summary_counts_what_was_judged(document: Make) -> None:
    every = [
        judge(document(), truth([EFFECT])),
        judge(document(), truth(["joint_mass"])),
        judge(document(), truth(["density"]), d=2.0),
        judge(document(status=Status.NONE, effects=()), truth([])),
        judge(document(), truth([])),
        judge(document(status=Status.UNKNOWN, effects=()), truth([], novel=["crack"])),
        judge(document(effects=("joint_mass", EFFECT)), truth([EFFECT, "joint_mass"])),
        judge({"error": "AnalysisError: no", "seconds": 1.0}, truth(["joint_mass"])),
    ]
    found = summary(every)
    assert found["single_exact"] == {"count": 1, "of": 3, "share": pytest.approx(1 / 3)}
    assert found["false_alarm"]["count"] == 1
    assert found["pair_both"]["share"] == 1.0
    assert found["failed"] == ["7: AnalysisError: no"]
    assert record_from(found).cases == 8
    table = found["confusion"]
    row = table["counts"][table["there"].index("attachment")]
    assert dict(zip(table["named"], row, strict=True))["beam"] == 1
    said = markdown(found)
    assert "| false alarm | 50.0 % (1 of 2) | at most 2 % |" in said
    assert "<svg" in confusion(table)
    assert "<svg" in reliability(found)


def test_calibration_error_is_the_mean_distance_of_claim_and_truth() -> None:
    found = calibration([(0.93, True), (0.93, True), (0.93, True), (0.93, False)])
    assert found["bins"] == [{"claimed": pytest.approx(0.93), "right": 0.75, "cases": 4}]
    assert found["error"] == pytest.approx(0.18)


def test_the_error_of_few_claims_is_compared_with_that_of_right_probabilities() -> None:
    one, other = 0.92, 0.98  # in one bin; of one claim that holds with 0.95 the distance is 2 * 0.95 * 0.05
    assert calibration([(0.95, True)])["by_chance"] == pytest.approx(2 * 0.95 * 0.05)
    both = one * other * 0.1 + (one * (1 - other) + other * (1 - one)) * 0.9 + (1 - one) * (1 - other) * 1.9
    assert calibration([(one, True), (other, True)])["by_chance"] == pytest.approx(both / 2)
    assert calibration([])["by_chance"] is None
