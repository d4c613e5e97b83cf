"""What an explanation expects of further data is what the simulation gives for parameters as uncertain as they are."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.gap.effect import Effect
from analysis.gap.effects.beam import AccelerometerMass, YoungsModulus
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.model_evidence import log_evidence
from analysis.gap.evidence.verdict import UNKNOWN, Weighed
from analysis.gap.experiments.expected_data import as_expected, expected_data, new_points, new_rows
from analysis.gap.experiments.information import expected_information, log_posterior
from analysis.gap.fitting.fit import fit, in_other_set_up
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import Model, without_effects
from analysis.gap.fitting.stages import FINAL
from analysis.gap.measurement import Measurement, Rig
from analysis.gap.search.single_effects import search_of
from analysis.gap.simulation.free_beam_modes import beam_modes_of
from tests.analysis.gap.conftest import Made

EXACT = replace(UNCALIBRATED, form_error=0.0, least_form_error=0.0, known_form_error=0.0, patterns=1e9)
"""Laws that are right."""


def fitted(measurement: Measurement, *effects: Effect) -> Model:
    search = search_of(measurement, ())
    simulation = replace(search.simulation(), modes=beam_modes_of(measurement.drawing), effects=effects)
    return Model(effects, fit(simulation, np.zeros(Likelihood(simulation).unknowns), tolerance=1e-6))


@pytest.fixture(scope="module")
def two(made: Made) -> list[Weighed[Model]]:
    """Explanations of a bench whose accelerometer is too heavy, as probable as each other before."""
    measurement = made((AccelerometerMass(),), (0.4,))
    models = [fitted(measurement, AccelerometerMass()), fitted(measurement, YoungsModulus())]
    return [Weighed(each.ids, each, 0.0, 0.5) for each in models]


@pytest.fixture(scope="module")
def further(two: list[Weighed[Model]]) -> Measurement:
    """A repetition of the first set."""
    first = two[0].model.fit.likelihood.measurement
    return replace(first, sets=tuple(each.thinned(30) for each in first.sets[:1]))


def test_the_spread_is_that_of_simulations_with_uncertain_parameters(
    two: list[Weighed[Model]], further: Measurement
) -> None:
    model = two[0].model
    expected = expected_data(two[:1], None, further, (Rig.BEAM, Rig.TESTER), EXACT)[0]
    seen = as_expected(model, further)
    likelihood, scores = in_other_set_up(model.fit, seen)
    shared = len(likelihood.simulation.shared)
    random = np.random.default_rng(2)
    factor = np.linalg.cholesky(model.fit.covariance[:shared, :shared])
    small, moved = 0.1, []
    for _ in range(1500):
        unknown = small * random.standard_normal(scores.size)
        unknown[:shared] = scores[:shared] + factor @ unknown[:shared]
        moved.append(-likelihood.columns(unknown, (0,))[1])
    drawn = np.var(moved, axis=0) / small**2
    linear = np.sum(expected.spread**2, axis=0)
    assert expected.mean == pytest.approx(np.zeros(linear.size), abs=1e-6)
    assert np.mean(linear) == pytest.approx(float(np.mean(drawn)), rel=0.1)
    assert np.corrcoef(linear, drawn)[0, 1] > 0.98


def test_the_odds_after_further_data_are_those_of_a_fit_to_all_data(
    two: list[Weighed[Model]], further: Measurement
) -> None:
    random = np.random.default_rng(3)
    expected = expected_data(two, None, further, (Rig.BEAM,), EXACT)
    seen = as_expected(two[0].model, further)
    only = seen.sets[0]
    noise = random.standard_normal((*only.accelerance.shape, 2)) @ np.array([1.0, 1j])
    noisy = replace(only, accelerance=only.accelerance + only.deviation * noise, reference=only.from_neighbours)
    gains = []
    for each in two:
        alone, first = each.model.fit, each.model.fit.likelihood.measurement
        both = alone.likelihood.simulation.of(replace(first, sets=(*first.sets, noisy)))
        start = np.zeros(Likelihood(both).unknowns)
        start[: len(both.shared)] = alone.scores[: len(both.shared)]
        together = fit(both, start, (FINAL,), tolerance=1e-6)
        gains.append(log_evidence(together) - log_evidence(alone))
    likelihood, scores = in_other_set_up(two[0].model.fit, replace(seen, sets=(noisy,)))
    data = likelihood.columns(scores, (0,))[1][: expected[0].mean.size]
    found = np.exp(log_posterior(expected, data))
    assert 0.6 < found[0] < 1 - 1e-9
    assert np.log(found[0] / found[1]) == pytest.approx(gains[0] - gains[1], rel=0.1)


def test_an_unknown_cause_does_again_what_it_did_and_anything_under_new_conditions(
    two: list[Weighed[Model]], further: Measurement
) -> None:
    first = two[0].model.fit.likelihood.measurement
    struck, points = further.sets[0], first.points
    assert points is not None
    assert new_rows(first, first.drawing, struck)[0] == pytest.approx(0.0)
    twice = new_rows(first, first.drawing, replace(struck, peak_force=2 * first.sets[-1].peak_force))[0]
    assert twice == pytest.approx(np.sqrt(1 - np.exp(-1.0)))
    assert new_rows(first, replace(first.drawing, accelerometer_mass=0.1), struck)[0] == pytest.approx(1.0)
    assert new_rows(replace(first, sets=()), first.drawing, struck)[0] == pytest.approx(1.0)
    assert new_points(points, points)[0] == pytest.approx(0.0)
    assert np.min(new_points(points, replace(points, frequency=100 * points.frequency))[0]) > 0.99
    assert new_points(None, points)[0] == pytest.approx(1.0)
    unknown = [two[0], Weighed(UNKNOWN, two[0].model, 0.0, 0.5)]
    harder = replace(further, sets=(replace(struck, peak_force=4 * first.sets[-1].peak_force),))
    none = Model((), fitted(first).fit)
    again, new = (
        expected_information(expected_data(unknown, none, each, (Rig.BEAM,), EXACT)) for each in (further, harder)
    )
    assert again < 0.05
    assert new > 0.2


def test_what_speaks_against_an_explanation_already_does_not_once_more(
    two: list[Weighed[Model]], further: Measurement
) -> None:
    first = two[0].model.fit.likelihood.measurement
    refuted = Weighed((), without_effects(two[0].model, fitted(first)), 0.0, 0.5)
    assert refuted.model.misfit.certain > 100
    ample = replace(EXACT, patterns=10.0)
    elsewhere = replace(further, drawing=replace(first.drawing, accelerometer=Dof(7, Direction.Y)))
    fresh, known, new = (
        float(np.linalg.norm(expected_data([two[0], refuted], None, each, (Rig.BEAM,), laws)[1].mean))
        for each, laws in ((further, EXACT), (further, ample), (elsewhere, ample))
    )
    assert known < 0.3 * fresh
    assert new > 0.5 * fresh
