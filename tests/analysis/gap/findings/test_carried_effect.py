"""An effect found on one article, put in the simulation of another."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.gap.catalogue import laws
from analysis.gap.effect import Effect, acts_on
from analysis.gap.effects.attachment import FoundationCompliance
from analysis.gap.effects.joint_geometry import SupportPosition
from analysis.gap.effects.measuring_chain import ChannelDelay
from analysis.gap.effects.tester import FrameCompliance
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.findings.carried_effect import carry, with_priors
from analysis.gap.findings.model_values import EffectValues, values_of
from analysis.gap.fitting.fit import fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import Model
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import ParameterEstimate
from analysis.gap.search.single_effects import search_of
from tests.analysis.gap.conftest import Made

DELAY = ChannelDelay()


@pytest.fixture(scope="module")
def found(made: Made) -> tuple[EffectValues, ...]:
    """The delay of a channel, as the first article shows it: a fixed verdict without a search."""
    simulation = search_of(made((DELAY,), (1.0,), seed=1), ()).simulation((DELAY,))
    model = Model((DELAY,), fit(simulation, np.zeros(Likelihood(simulation).unknowns)))
    return values_of(model, UNCALIBRATED).effects


def test_it_lowers_the_gap_of_an_article_that_has_it(made: Made, found: tuple[EffectValues, ...]) -> None:
    there = carry(made((DELAY,), (1.0,), seed=2).thinned(30), found)
    assert there.lowers
    assert there.after.overall.percent < 1.2 * there.floor_percent < there.before.overall.percent / 2
    assert max(map(abs, there.apart[0].values())) < 2
    assert there.model.effects[0].parameters["tau"].value == pytest.approx(found[0].parameters["tau"].value, rel=0.1)


def test_it_does_not_lower_the_gap_of_an_article_without_it(made: Made, found: tuple[EffectValues, ...]) -> None:
    there = carry(made(seed=2).thinned(30), found)
    assert not there.lowers
    assert there.after.overall.percent > 0.99 * there.before.overall.percent


@pytest.fixture(scope="module")
def struck(made: Made) -> Measurement:
    """An article that was never in the tester."""
    return replace(made(seed=3).thinned(30), points=None)


ESTIMATE = ParameterEstimate(0.01, (0.008, 0.012), "m")


def values(effect: type[Effect], *names: str, known: ParameterEstimate = ESTIMATE) -> EffectValues:
    return EffectValues(effect.id, effect.law, {}, dict.fromkeys(names, known))


@pytest.mark.parametrize(
    ("effects", "said"),
    [
        ((), "has no effect that could be carried"),
        ((EffectValues("joint_mass", "square", {}, {}),), "no effect 'joint_mass' with the law 'square'"),
        ((values(SupportPosition, "dx_left", "dx_right"),), "whose joints or points differ"),
        ((values(FrameCompliance, "c"),), "acts on a rig that this article was not measured in"),
        ((values(ChannelDelay, "tau", known=replace(ESTIMATE, ci90=(0.01, 0.01))),), "lower end has to be below"),
        ((EffectValues(FoundationCompliance.id, FoundationCompliance.law, {"joint": "7"}, {}),), "joint 7"),
    ],
)
def test_what_does_not_apply_is_refused(struck: Measurement, effects: tuple[EffectValues, ...], said: str) -> None:
    with pytest.raises(AnalysisError, match=said):
        carry(struck, effects)


def test_every_effect_keeps_its_hooks_under_other_priors(empty: Measurement) -> None:
    for law in laws():
        for effect in law.variants(empty)[:1]:
            known = {
                each.name: ParameterEstimate(each.value(0.5), (each.value(0.4), each.value(0.6)), each.unit)
                for each in effect.parameters
            }
            carried = pickle.loads(pickle.dumps(with_priors(effect, known)))
            assert [each.value(0.0) for each in carried.parameters] == [known[n].value for n in known]
            hooks = ("cylinders", "mounting", "joints", "beam", "tester")
            assert [acts_on(carried, hook) for hook in hooks] == [acts_on(effect, hook) for hook in hooks]
            assert carried.follows_motion == effect.follows_motion
    assert with_priors(DELAY, {"tau": ESTIMATE}).parameters[0].spread == pytest.approx(0.002 / 1.645, rel=1e-3)
