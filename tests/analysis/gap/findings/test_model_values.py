"""A model by its values is the same simulation again, under every effect of the catalogue."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.gap.catalogue import candidates, law_free
from analysis.gap.effect import Effect
from analysis.gap.effects.attachment import FoundationCompliance
from analysis.gap.effects.joint_amplitude import CubicStiffness
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.findings.model_values import EffectValues, effect_of, simulated, values_of, variant_of
from analysis.gap.fitting.fit import evaluated
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import Model
from analysis.gap.fitting.requested_rows import at_rows
from analysis.gap.measurement import Measurement
from tests.analysis.gap.conftest import INPUTS, simulation_of

FEW = slice(None, None, 16)


@pytest.fixture(scope="module")
def few(empty: Measurement) -> Measurement:
    """Few lines, and another tester gain than the priors are centred on."""
    keep = np.arange(empty.sets[0].frequency.size)[FEW]
    return replace(empty, sets=tuple(each.lines(keep) for each in empty.sets))


def drawn(measurement: Measurement, effects: tuple[Effect, ...]) -> Model:
    """A model whose unknowns were drawn at random, not fitted."""
    simulation = simulation_of(measurement, *effects)
    likelihood = Likelihood(simulation)
    scores = 0.3 * np.random.default_rng(4).standard_normal(likelihood.unknowns)
    scores[likelihood.first_blow[0] : likelihood.first_blow[-1]] = 0.0
    return Model(effects, evaluated(likelihood, scores))


def test_the_values_of_a_model_give_its_predictions_again(few: Measurement) -> None:
    frequency = few.sets[0].frequency
    moved = FoundationCompliance(1), CubicStiffness()
    model = drawn(few, moved)
    values = values_of(model, UNCALIBRATED)
    assert values.effects[0].variant == {"joint": "1"}
    assert len(values.motion) == len(INPUTS)
    assert few.points is not None
    elsewhere = replace(few, points=replace(few.points, stiffness=1.3 * few.points.stiffness))  # other priors
    known = (model.fit.likelihood, model.fit.scores), simulated(values, few), simulated(values, elsewhere)
    at = [at_rows(likelihood, scores, INPUTS, frequency) for likelihood, scores in known]
    expected, *others = [likelihood.predict(scores, ()).accelerances[0] for likelihood, scores in at]
    for found in others:
        np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_every_variant_of_every_law_is_found_again(few: Measurement) -> None:
    laws = (*candidates(few), *law_free(few))
    deviating = [bent for each in laws if (bent := each.bent(few)) is not None]
    assert deviating
    for effect in (*laws, *deviating):
        known = {each.name: each.value(0.5) for each in effect.parameters}
        assert [each.score(known[each.name]) for each in effect.parameters] == pytest.approx([0.5] * len(known))
        found = EffectValues(effect.id, effect.law, variant_of(effect, few), {})
        assert effect_of(found, few) == effect


def test_a_law_that_is_no_more_is_named(few: Measurement) -> None:
    with pytest.raises(AnalysisError, match="no effect 'joint_mass' with the law 'square'"):
        effect_of(EffectValues("joint_mass", "square", {}, {}), few)


def test_a_model_of_other_dimensions_is_refused(few: Measurement) -> None:
    values = values_of(drawn(few, ()), UNCALIBRATED)
    amended = replace(few, drawing=replace(few.drawing, beam=replace(few.drawing.beam, length=0.9)))
    with pytest.raises(AnalysisError, match="diagnose it again"):
        simulated(values, amended)
