"""A trial of one's own simulator: cases that can be told apart are named, and its score limits what is told."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.gap.structures.curve import Curve
from jointlab.errors import JointlabError
from jointlab.structures.plug_ins import simulator_named
from jointlab.structures.trial import read_record, trial_document, try_cases

EXAMPLES = Path(__file__).resolve().parents[3] / "docs" / "examples"


def template() -> list[Curve]:
    mass = np.linspace(0.5, 3.0, 8)
    return [
        Curve("frequency", f"{warm:g}", np.ones(8), np.full(8, 2e-3), {"mass": mass, "temperature": np.full(8, warm)})
        for warm in (10.0, 20.0, 30.0, 40.0)
    ]


def test_cases_with_a_clear_effect_are_named_and_those_without_are_not() -> None:
    found = try_cases(simulator_named(f"{EXAMPLES / 'own_simulator.py'}:pendulum"), template(), 30, 1)
    document = trial_document(found, "mass on a spring", 1)
    assert document["strong"]["cases"] >= 10
    assert document["strong"]["named"] >= 0.9 * document["strong"]["cases"]
    assert document["none"]["cases"] >= 3
    assert document["none"]["false_alarms"] <= 1


def test_the_same_seed_draws_the_same_cases() -> None:
    simulator = simulator_named(f"{EXAMPLES / 'own_simulator.py'}:pendulum")
    first, second = (try_cases(simulator, template(), 4, 3) for _ in range(2))
    assert [(each.truth, each.strength) for each in first] == [(each.truth, each.strength) for each in second]


def scores(**changes: Any) -> dict[str, Any]:
    return trial_document([], "mass on a spring", 1) | changes


def test_scores_are_read_as_they_were_published(tmp_path: Path) -> None:
    (tmp_path / "scores.json").write_text(json.dumps(scores()), encoding="utf-8")
    assert read_record(tmp_path / "scores.json", "mass on a spring") == scores()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "the whole: Invalid JSON"),
        ("[]", "the whole: Input should be an object"),
        ('{"format": "jointlab-structure-trial/1"}', "simulator: Field required"),
        (json.dumps(scores(strong={"cases": 3})), "strong.named: Field required"),
        (json.dumps(scores(none={"cases": 3, "false_alarms": "few"})), "none.false_alarms: Input should be"),
        (json.dumps(scores(strong={"cases": 3, "named": 5})), "more cases are counted than there are"),
        (json.dumps(scores(format="another")), "format: Input should be"),
        (json.dumps(scores(simulator="another")), "is of the simulator 'another', not of 'mass on a spring'"),
    ],
)
def test_a_file_that_lacks_scores_is_refused_with_what_it_lacks(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "scores.json").write_text(text, encoding="utf-8")
    with pytest.raises(JointlabError, match=said):
        read_record(tmp_path / "scores.json", "mass on a spring")
