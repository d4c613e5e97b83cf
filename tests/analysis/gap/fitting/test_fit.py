"""Fits in stages: what they share, and where they end."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from analysis.gap.fitting.fit import evaluated, fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.stages import CLOSE, FINAL, Stage
from analysis.gap.simulation.simulation_state import SimulationState, state_of
from analysis.gap.simulation.two_rigs import Simulation
from tests.analysis.gap.fitting.conftest import WithSmoothErrors


def test_a_stage_begins_with_the_state_in_which_the_one_before_ended(
    simulation: Simulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = list[bytes]()

    def counted(simulation: Simulation, scores: np.ndarray, *own: Any) -> SimulationState:
        asked.append(scores.tobytes())
        return state_of(simulation, scores, *own)

    monkeypatch.setattr("analysis.gap.fitting.likelihood.state_of", counted)
    schedule = (Stage(0.1), Stage(0.03), FINAL)
    found = fit(simulation, np.zeros(Likelihood(simulation).unknowns), schedule)
    assert found.converged
    assert len(asked) > len(schedule)
    assert not [once for once, again in pairwise(asked) if once == again]


def test_a_stage_sees_no_more_lines_and_no_higher_ones_than_it_needs(simulation: Simulation) -> None:
    measurement = simulation.baseline.measurement
    seen = Stage(0.1, highest=300.0, lines=20).seen(measurement)
    assert all(each.frequency[-1] <= 300.0 and 20 <= each.frequency.size < 40 for each in seen.sets)
    assert seen.points is measurement.points
    assert FINAL.seen(measurement) is measurement


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


@pytest.mark.parametrize("common", [0.0, 0.7, 1.0])
def test_what_rows_say_given_all_others_is_what_all_say_beyond_the_others(
    with_smooth_errors: WithSmoothErrors, common: float
) -> None:
    likelihood = with_smooth_errors(common)
    values, (first, second) = np.zeros(likelihood.unknowns), likelihood.measurement.sets
    found = evaluated(likelihood, values)
    out = [(0, 2), (1, 4)]
    keep = [np.arange(len(each.inputs)) != row for each, (_, row) in zip((first, second), out, strict=True)]
    rest = replace(likelihood.measurement, sets=(first.rows(keep[0]), second.rows(keep[1])))
    blows = [place for number, row in out for place in likelihood.blow_of_row(number, row)]
    others = Likelihood(likelihood.simulation.of(rest)).at(np.zeros(likelihood.unknowns - len(blows)))
    assert found.at.cost - sum(each.chi_square for each in found.left_out(out)) == pytest.approx(others.cost)
    normal = found.at.normal.copy()
    for each in found.left_out(out):
        normal[np.ix_(each.unknowns, each.unknowns)] -= each.normal
    known = np.delete(np.arange(likelihood.unknowns), blows)
    expected = others.linearised().normal
    assert np.allclose(normal[np.ix_(known, known)], expected, rtol=0, atol=1e-6 * np.abs(np.diag(expected)).max())
