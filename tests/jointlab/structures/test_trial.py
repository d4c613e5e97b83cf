"""A trial of one's own simulator: cases that can be told apart are named, and its score limits what is told."""

from pathlib import Path

import numpy as np

from analysis.gap.structures.curve import Curve
from jointlab.structures.plug_ins import simulator_named
from jointlab.structures.trial import trial_document, try_cases

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
