"""Fits in stages: what they share, and where they end."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from analysis.gap.baseline import baseline_of
from analysis.gap.effects.tester import FrameCompliance
from analysis.gap.fit import CLOSE, FINAL, LastState, Likelihood, Stage, fit
from analysis.gap.free_beam_modes import beam_modes_of
from analysis.gap.simulation import Simulation, State
from tests.analysis.gap.conftest import Made


@pytest.fixture(scope="module")
def simulation(made: Made) -> Simulation:
    measurement = made((FrameCompliance(),), (0.5,))
    return Simulation(baseline_of(measurement), beam_modes_of(measurement.drawing), (FrameCompliance(),))


def test_a_stage_begins_with_the_state_in_which_the_one_before_ended(
    simulation: Simulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = list[bytes]()
    state = Simulation.state

    def counted(self: Simulation, scores: np.ndarray, *own: Any) -> State:
        asked.append(scores.tobytes())
        return state(self, scores, *own)

    monkeypatch.setattr(Simulation, "state", counted)
    found = fit(simulation, np.zeros(Likelihood(simulation).unknowns), CLOSE)
    assert found.converged
    assert len(asked) > len(CLOSE)
    assert not [once for once, again in pairwise(asked) if once == again]


def test_a_shared_state_is_computed_again_for_other_scores(simulation: Simulation) -> None:
    zero = np.zeros(Likelihood(simulation).unknowns)
    sharing = Likelihood(simulation, last_state=LastState(zero))
    for scores in (zero, zero + 0.1, zero):
        assert sharing.at(scores).cost == Likelihood(simulation).at(scores).cost


def test_a_hopeless_model_ends_at_the_first_stage_that_shows_it_and_is_seen_with_true_noise(
    simulation: Simulation,
) -> None:
    zero = np.zeros(Likelihood(simulation).unknowns)
    first = CLOSE[0]
    ended = fit(simulation, zero, CLOSE, hopeless={first: 0.0})
    only = fit(simulation, zero, (first,), tolerance=30.0)
    assert np.array_equal(ended.scores, only.scores)
    assert not ended.converged
    assert ended.likelihood.inflation == 0.0
    assert ended.at.cost == pytest.approx(Likelihood(simulation).at(ended.scores).cost)
    assert ended.at.cost > only.at.cost


def test_a_model_is_searched_to_the_end_where_no_stage_calls_it_hopeless(simulation: Simulation) -> None:
    zero = np.zeros(Likelihood(simulation).unknowns)
    found = fit(simulation, zero, CLOSE, hopeless=dict.fromkeys(CLOSE[:-1], np.inf) | {Stage(0.5): 0.0})
    assert found.converged
    again = fit(simulation, found.scores, (FINAL,), hopeless={FINAL: 0.0})
    assert again.converged, "the last stage is never cut short"
