"""What a diagnosis says of a model beside its name."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.gap.catalogue import candidates
from analysis.gap.diagnosis import MORE_LINES, Ranked, diagnose, predictions, searched, with_records
from analysis.gap.diagnosis_step import StepReport
from analysis.gap.effect import Effect, Mechanism, RecordEffect
from analysis.gap.effects.beam import AccelerometerMass
from analysis.gap.effects.tester import FrameCompliance
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.verdict import Status
from analysis.gap.findings.intervals import estimates
from analysis.gap.fitting.fit import evaluated, fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import Model
from analysis.gap.fitting.requested_rows import at_rows
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import ParameterEstimate
from analysis.gap.search.single_effects import LINES, Search, search_of
from analysis.gap.simulation.baseline import baseline_of
from analysis.gap.simulation.free_beam_modes import beam_modes_of
from analysis.gap.simulation.two_rigs import Simulation
from analysis.interval import Z90
from tests.analysis.gap.conftest import Made, fitted, measured
from tests.jointlab.diagnosis.conftest import handmade


@pytest.mark.parametrize("score", [0.001, 1.0])
@pytest.mark.parametrize("effect", [AccelerometerMass(), FrameCompliance()], ids=lambda effect: effect.id)
def test_the_size_of_an_effect_is_known_as_well_as_noise_allows_and_no_better_than_its_law(
    made: Made, effect: Effect, score: float
) -> None:
    share = UNCALIBRATED.least_form_error if effect.form_is_known else UNCALIBRATED.parameter_error
    simulation = search_of(made((effect,), (score,)), ()).simulation((effect,))
    model = Model((effect,), fit(simulation, np.zeros(Likelihood(simulation).unknowns)))
    (found,) = estimates(model, UNCALIBRATED)[0].values()
    (parameter,), (place,) = effect.parameters, model.places(0)
    low, high = found.ci90
    assert low < parameter.value(score) < high
    noise = Z90 * parameter.spread * model.fit.deviations[place]
    assert (high - low) / 2 == pytest.approx(np.hypot(noise, Z90 * share * found.value), rel=0.1)
    assert found.unit == parameter.unit


@pytest.mark.parametrize(("score", "lines"), [(0.0, 400), (1.0, LINES)])
def test_a_search_is_repeated_on_more_lines_where_few_show_no_effect(
    empty: Measurement, score: float, lines: int
) -> None:
    frequency = np.linspace(20.0, 520.0, 400)
    shape = len(empty.sets[0].inputs), frequency.size
    close = [
        replace(each, frequency=frequency, accelerance=np.ones(shape, dtype=complex), deviation=np.full(shape, 2e-3))
        for each in empty.sets
    ]
    effect = AccelerometerMass()
    measurement = measured(replace(empty, sets=tuple(close)), (effect,), (score,))

    def search_on(wanted: int) -> Search:
        return search_of(measurement, (effect,), wanted)

    search, none, found = searched(measurement, search_on, UNCALIBRATED, StepReport())
    assert [each.frequency.size for each in search.measurement.sets] == pytest.approx([lines, lines], rel=0.05)
    assert none.fit.likelihood.data == found[0].fit.likelihood.data
    assert lines < MORE_LINES


UNSEEN = (Dof(5, Direction.Y), Dof(8, Direction.Y), Dof(11, Direction.X))


def test_points_that_were_not_struck_are_predicted_under_every_effect(empty: Measurement) -> None:
    asked = replace(empty, predict=tuple((empty.drawing.accelerometer, point) for point in UNSEEN))
    baseline, modes = baseline_of(asked), beam_modes_of(asked.drawing)
    plain = Likelihood(Simulation(baseline, modes))
    before = evaluated(plain, np.zeros(plain.unknowns))
    for effect in candidates(asked):
        likelihood = Likelihood(Simulation(baseline, modes, (effect,)))
        found = predictions(asked, before, evaluated(likelihood, np.zeros(likelihood.unknowns)))
        assert found is not None
        assert found.after.shape == (len(UNSEEN), found.frequency.size), effect.id
        assert np.all(np.isfinite(found.after)), effect.id


def test_what_is_told_of_the_papers_model_is_fitted_under_its_own_scales(made: Made) -> None:
    """One set that is wrong drew it far off under the scales of a model that explains this set: by 30 % at points that
    were not struck.
    """
    clean = made().thinned(40)
    response, first = clean.drawing.accelerometer, clean.sets[0]
    asked = tuple((response, point) for point in UNSEEN[:2])
    turned = replace(clean.sets[1], accelerance=clean.sets[1].accelerance * np.exp(0.8j))
    without = frozenset(each.id for each in candidates(clean))
    found = diagnose(replace(clean, sets=(first, turned), predict=asked), without)
    known = fitted(clean)
    whole, scores = at_rows(known.likelihood, known.scores, UNSEEN[:2], first.frequency)
    true = whole.predict(scores, ()).accelerances[0][-2:]
    assert found.status is Status.UNKNOWN
    assert found.predicted is not None
    assert np.linalg.norm(found.predicted.before - true) < 0.2 * np.linalg.norm(true)
    assert found.where[0].where["level"] == 2


def ranked(probability: float, *effects: str) -> Ranked:
    return Ranked(effects, tuple("law" for _ in effects), probability, None, {}, 0.0)


def test_what_records_show_is_the_verdict_where_no_model_explains_the_gap() -> None:
    """Double hits were said among the faults, and the verdict was an unknown cause."""
    hit = RecordEffect(
        "double_hit", {"ratio": ParameterEstimate(0.3, (0.2, 0.4), "1")}, "4 of 9 blows kept are double hits"
    )
    found = with_records(handmade(status=Status.UNKNOWN, effects=(), ranking=UNEXPLAINED), [hit])
    assert (found.status, found.effects) == (Status.PARTIAL, ("double_hit",))
    probabilities = {each.effects: each.probability for each in found.ranking}
    assert probabilities["double_hit",] > 0.9
    assert probabilities["unknown",] < 0.05
    assert sum(probabilities.values()) == pytest.approx(1.0)
    assert found.included[0].id == "double_hit"
    assert found.mechanisms[Mechanism.BLOW] > 0.9


UNEXPLAINED = (ranked(0.98, "unknown"), ranked(0.02))
