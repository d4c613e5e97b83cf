"""Which explanation wins, and which cannot be distinguished, from models whose evidence is known."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.gap.effect import Effect, Mechanism
from analysis.gap.effects.beam import AccelerometerMass, AccelerometerWithCable, Density, YoungsModulus
from analysis.gap.effects.joint_frequency import LossLaw
from analysis.gap.effects.joint_state import ShownTemperatureShift, TemperatureShift
from analysis.gap.effects.measuring_chain import HighpassCorner, SensorGain
from analysis.gap.effects.tester import FixtureInertia, FrameCompliance, TransducerLag
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.contest import Contest, contenders
from analysis.gap.evidence.model_evidence import log_evidence
from analysis.gap.evidence.plausibility import CHANCE
from analysis.gap.evidence.residual_structure import CHANCE_LIMIT
from analysis.gap.evidence.verdict import (
    UNKNOWN,
    Weighed,
    confounded_effects,
    included,
    leading,
    outside_log_odds,
    unfit,
    with_refuted,
)
from analysis.gap.evidence.verdict import weigh as weigh_with
from analysis.gap.fitting.fit import Fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import Model
from analysis.gap.outside_catalogue.local_change import CHANGES
from analysis.gap.outside_catalogue.tester_change import StepInTime
from analysis.gap.parameter import Parameter
from analysis.inverse.levenberg_marquardt import Linearised
from tests.analysis.gap.evidence.stated_models import model


def weigh(none: Model, models: list[Model]) -> tuple[Weighed[Model], ...]:
    return weigh_with(none, models, UNCALIBRATED)


def test_probabilities_sum_to_one_and_fall() -> None:
    none = model((), 3000.0, 2000.0)
    tried = [
        model((AccelerometerMass(),), 1500.0, 300.0),
        model((FrameCompliance(),), 1000.0),
        model((FrameCompliance(), TransducerLag()), 999.0),
    ]
    weighed = weigh(none, tried)
    assert sum(each.probability for each in weighed) == pytest.approx(1.0)
    assert [each.probability for each in weighed] == sorted((each.probability for each in weighed), reverse=True)
    assert {each.effects for each in weighed} == {
        (),
        ("accelerometer_mass",),
        ("frame_compliance",),
        ("frame_compliance", "transducer_lag"),
        UNKNOWN,
    }


@given(st.lists(st.floats(500.0, 5000.0), min_size=3, max_size=3), st.floats(0.0, 4000.0))
def test_probabilities_sum_to_one_whatever_the_models(costs: list[float], left: float) -> None:
    effects = (AccelerometerMass(),), (FrameCompliance(),), (FrameCompliance(), TransducerLag())
    tried = [model(of, cost, left) for of, cost in zip(effects, costs, strict=True)]
    weighed = weigh(model((), 5000.0, 4000.0), tried)
    assert sum(each.probability for each in weighed) == pytest.approx(1.0)
    assert all(0 <= each.probability <= 1 for each in weighed)


def test_an_effect_that_explains_all_wins() -> None:
    none = model((), 4000.0, 3000.0)
    best, *others = weigh(none, [model((FrameCompliance(),), 1000.0), model((AccelerometerMass(),), 2000.0, 1000.0)])
    assert best.effects == ("frame_compliance",)
    assert best.probability > 0.95
    assert others[0].probability < 0.05


@pytest.mark.parametrize(
    ("shift", "named"),
    [(TemperatureShift(), False), (ShownTemperatureShift(1.1), False), (ShownTemperatureShift(-4.0), True)],
)
def test_a_temperature_that_thermometers_show_needs_less_evidence(shift: TemperatureShift, named: bool) -> None:
    none, frame = model((), 4000.0, 3000.0), model((FrameCompliance(),), 1000.0)
    weighed = weigh(none, [frame, model((FrameCompliance(), shift), 938.0, score=0.5)])
    assert ("temperature_shift" in weighed[0].effects) is named
    assert sum(each.probability for each in weighed) == pytest.approx(1.0)


def test_thermometers_alone_make_no_effect_where_the_joints_of_both_rigs_are_alike() -> None:
    """To explain nothing, rubber would have to soften ten times less than any does."""
    none, shift = model((), 1000.0), model((ShownTemperatureShift(-4.0),), 999.0, score=-4.5)
    assert weigh(none, [shift])[0].effects == ()


def test_without_a_gap_there_is_no_effect() -> None:
    none = model((), 1000.0)
    weighed = weigh(none, [model((FrameCompliance(),), 999.0, score=0.1)])
    assert weighed[0].effects == ()
    assert weighed[0].probability > 0.9


def test_evidence_decides_where_data_left_out_are_indifferent_and_both_where_they_are_not() -> None:
    """A gain far beyond what is stated changes no prediction of a row from the others, as these show the gain, too."""
    none = model((), 1100.0)

    def probability(predictive: float) -> float:
        weighed = weigh_with(none, [model((SensorGain(),), 1000.0, predictive=predictive)], UNCALIBRATED, left_out=True)
        return next(each.probability for each in weighed if each.effects == ("sensor_gain",))

    assert probability(0.0) > 0.95
    assert probability(-20.0) < 0.55
    assert probability(-20.0) < probability(-4.0) < probability(0.0)


def test_what_a_trace_foresees_is_foreseen_without_an_effect() -> None:
    weighed = weigh_with(
        model((), 1000.0),
        [model((FrameCompliance(),), 990.0, score=0.01, predictive=30.0)],
        UNCALIBRATED,
        left_out=True,
    )
    assert weighed[0].effects == ()
    assert weighed[0].probability > 0.9


def test_a_trace_within_tolerance_is_no_explanation() -> None:
    """Its model fits far better, yet by no more of the effect than every bench has: that speaks for none."""
    none = model((), 1040.0)
    weighed = weigh(none, [model((TransducerLag(),), 1000.0, score=0.02)])
    assert weighed[0].effects == ()
    more = weigh(none, [model((TransducerLag(),), 1000.0, score=1.0)])
    assert more[0].effects == ("transducer_lag",)


def test_a_little_of_an_effect_that_makes_more_than_a_faint_gap_is_no_trace() -> None:
    none = model((), 3000.0, 2000.0)
    weighed = weigh(none, [model((TransducerLag(),), 1000.0, score=0.02)])
    assert weighed[0].effects == ("transducer_lag",)


def test_a_trace_in_a_pair_speaks_for_the_other_alone() -> None:
    none = model((), 4000.0, 3000.0)
    both = model((FrameCompliance(), TransducerLag()), 990.0)
    both.fit.scores[1] = 0.02
    weighed = weigh(none, [model((FrameCompliance(),), 1020.0), both])
    assert weighed[0].effects == ("frame_compliance",)


def test_the_unknown_wins_where_every_model_fits_badly() -> None:
    none = model((), 9000.0, 8000.0)
    tried = [model((FrameCompliance(),), 8000.0, 7000.0), model((AccelerometerMass(),), 8200.0, 7200.0)]
    weighed = weigh(none, tried)
    assert weighed[0].effects == UNKNOWN
    assert weighed[0].model.ids == ("frame_compliance",)


def test_an_explanation_beyond_its_range_says_nothing_against_one_that_is_as_good_within_its_own() -> None:
    none = model((), 9000.0, 8000.0)
    within = model((FrameCompliance(),), 1000.0, 10.0)
    beyond = model((FrameCompliance(), TransducerLag()), 600.0, 10.0, score=6.0)
    contest = Contest(none, [within, beyond], UNCALIBRATED)
    assert contest.score(beyond) > contest.score(within) + 10.0
    verdict = leading(weigh(none, [within, beyond]))
    assert verdict.effects == ("frame_compliance",)
    assert verdict.probability > 0.9
    assert leading(weigh(none, [beyond])).effects == UNKNOWN


def test_what_a_mass_leaves_is_no_error_of_its_law() -> None:
    """A law of unknown form may leave a few hundredths of its gap, a mass may not."""
    none = model((), 1e6, 1e6)
    for effect, known in ((FrameCompliance(), False), (AccelerometerMass(), True)):
        least, most = UNCALIBRATED.form_errors(known)
        contest = Contest(none, [model((effect,), 1e3 + 2e3, 2e3)], UNCALIBRATED)
        assert 1e6 * least**2 <= UNCALIBRATED.patterns * contest.overdispersion <= 1e6 * most**2 + 1


def test_the_more_is_left_the_likelier_is_a_cause_in_no_catalogue() -> None:
    none = model((), 101_000.0, 100_000.0)
    shares = [model((FrameCompliance(),), 1000.0 + left, left) for left in (100.0, 10_000.0, 90_000.0)]
    odds = [outside_log_odds(none, each, UNCALIBRATED) for each in shares]
    assert odds == sorted(odds)
    assert odds[0] < -5
    assert odds[-1] > 1


def test_a_remainder_beside_effects_that_explain_most_is_no_rival_to_them() -> None:
    """Two of three effects explain 91 %: they are named, and the rest is said beside them."""
    none = model((), 1e6, 1e6)
    both = model((FrameCompliance(), TransducerLag()), 9e4, 9e4)
    weighed = weigh(none, [model((FrameCompliance(),), 4e5, 4e5), both])
    assert leading(weighed).effects == ("frame_compliance", "transducer_lag")


def test_a_law_within_its_range_stands_for_an_explanation_whose_best_law_is_not() -> None:
    none = model((), 4000.0, 3000.0)
    beyond = model((AccelerometerMass(),), 1000.0, score=8.0)
    within = model((AccelerometerWithCable(),), 1070.0, score=1.0)
    assert beyond.log_evidence > within.log_evidence
    best = leading(weigh(none, [beyond, within]))
    assert best.effects == ("accelerometer_mass",)
    assert best.model is within


def test_many_effects_that_leave_next_to_nothing_are_no_cause_in_no_catalogue() -> None:
    none = model((), 1e6, 9e5)
    four = (FrameCompliance(), TransducerLag(), HighpassCorner(), TemperatureShift())
    assert outside_log_odds(none, model(four, 2000.0, 100.0), UNCALIBRATED) < -2.0
    assert outside_log_odds(none, model(four, 5e4, 4.5e4), UNCALIBRATED) > 0.0


def test_inclusion_adds_up_over_explanations() -> None:
    none = model((), 4000.0, 3000.0)
    tried = [model((FrameCompliance(),), 1000.0), model((FrameCompliance(), TransducerLag()), 985.0)]
    found = weigh(none, tried)
    weighed = {each.effects: each.probability for each in found}
    both = weighed["frame_compliance", "transducer_lag"]
    assert included(found)["transducer_lag"] == pytest.approx(both)
    assert included(found)["frame_compliance"] == pytest.approx(both + weighed["frame_compliance",])
    assert 0.01 < both < 0.99


def test_a_misfit_that_may_be_chance_is_no_cause() -> None:
    none = model((), 1000.0, CHANCE - CHANCE_LIMIT - 1)
    assert leading(weigh(none, [model((FrameCompliance(),), 999.0, score=0.1)])).effects == ()


def test_rival_laws_of_an_effect_count_as_one_by_their_mean() -> None:
    none = model((), 4000.0, 3000.0)
    law = model((HighpassCorner(),), 1000.0)
    once = {each.effects: each.score for each in weigh(none, [law])}
    rivals = weigh(none, [law, model((HighpassCorner(),), 1000.0), model((HighpassCorner(),), 2500.0)])
    averaged = {each.effects: each.score for each in rivals}
    over_none = [found["highpass_corner",] - found[()] for found in (averaged, once)]
    assert over_none[0] - over_none[1] == pytest.approx(np.log(2 / 3), abs=1e-6)
    assert len(rivals) == 3


def test_one_effect_goes_before_two_that_explain_as_much() -> None:
    none = model((), 4000.0, 3000.0)
    pair = model((AccelerometerMass(), TransducerLag()), 1000.0)
    assert weigh(none, [pair, model((FrameCompliance(),), 1000.0)])[0].effects == ("frame_compliance",)


def test_a_second_effect_that_takes_up_half_of_what_a_law_leaves_is_none() -> None:
    none = model((), 4e6 + 1000, 4e6)
    law = model((FrameCompliance(),), 5000.0, 4000.0)
    mop = model((FrameCompliance(), TransducerLag()), 3000.0, 2000.0)
    assert weigh(none, [law, mop])[0].effects == ("frame_compliance",)
    second = model((FrameCompliance(), TransducerLag()), 1000.0, 0.0)
    assert weigh(none, [law, second])[0].effects == ("frame_compliance", "transducer_lag")


class ManyUnknowns(TransducerLag):
    """As many unknowns as a smooth function has."""

    law = "smooth curve"
    own_parameters = tuple(Parameter(f"tau_{number}", "s", 0.0, 200e-6) for number in range(10))


def test_unknowns_of_a_second_effect_take_up_a_pattern_each_of_what_a_law_leaves() -> None:
    none, law = model((), 4e6 + 1000, 4e6), model((FrameCompliance(),), 1800.0, 800.0)
    few = model((FrameCompliance(), TransducerLag()), 1000.0, 0.0)
    many = model((FrameCompliance(), ManyUnknowns()), 1000.0, 0.0)
    assert (
        Contest(none, [law, few], UNCALIBRATED).overdispersion < Contest(none, [law, many], UNCALIBRATED).overdispersion
    )
    assert weigh(none, [law, many])[0].effects == ("frame_compliance",)


def test_each_effect_keeps_its_own_law_whichever_was_found_first() -> None:
    none = model((), 4000.0, 3000.0)
    laws = {each.effects: each.laws for each in weigh(none, [model((TransducerLag(), FrameCompliance()), 1000.0)])}
    assert laws == {
        ("frame_compliance", "transducer_lag"): (FrameCompliance.law, TransducerLag.law),
        (): (),
        UNKNOWN: (),
    }


def weighed(probability: float, *effects: Effect, score: float = 1.0) -> Weighed[Model]:
    """An explanation whose parameters are each `score` standard deviations large and well known."""
    shared = tuple(parameter for effect in effects for parameter in effect.parameters)
    simulation = SimpleNamespace(shared=shared, baseline=SimpleNamespace(parameters=()))
    likelihood = cast("Likelihood", SimpleNamespace(simulation=simulation, data=1, log_normalisation=0.0))
    normal = 1e4 * np.eye(len(shared))
    fit = Fit(likelihood, np.full(len(shared), score), Linearised(0.0, np.zeros(len(shared)), normal), True)
    ids = tuple(sorted(each.id for each in effects))
    return Weighed(ids, Model(tuple(effects), fit), float(np.log(probability)), probability)


def test_an_explanation_nearly_as_probable_is_confounded() -> None:
    found = [weighed(0.6, YoungsModulus()), weighed(0.3, Density()), weighed(0.01, FrameCompliance())]
    assert confounded_effects(found) == (("youngs_modulus", "density"),)


def test_a_clear_verdict_and_no_effect_are_not_confounded() -> None:
    assert confounded_effects([weighed(0.98, YoungsModulus()), weighed(0.01, Density())]) == ()
    assert confounded_effects([weighed(0.6), weighed(0.4, Density())]) == ()


def test_the_unknown_effect_is_confounded_with_none() -> None:
    unknown = Weighed(UNKNOWN, weighed(0.4, Density()).model, -1.0, 0.4)
    assert confounded_effects([weighed(0.6, YoungsModulus()), unknown]) == ()
    assert confounded_effects([unknown, weighed(0.3, YoungsModulus())]) == ()


def test_in_a_pair_effects_are_confounded_beside_a_shared_one() -> None:
    found = [
        weighed(0.5, FrameCompliance(), YoungsModulus()),
        weighed(0.3, FrameCompliance(), Density()),
        weighed(0.2, SensorGain(), TemperatureShift()),
    ]
    assert confounded_effects(found) == (("youngs_modulus", "density"),)


def test_of_explanations_that_are_as_probable_the_one_with_fewer_effects_is_the_verdict() -> None:
    none = model((), 0.0)
    shares = {("density",): 0.46, (): 0.45, ("density", "mesh_error"): 0.05, UNKNOWN: 0.04}
    weighed = [Weighed(ids, none, 0.0, share) for ids, share in shares.items()]
    assert leading(weighed).effects == ()
    clear = [Weighed(ids, none, 0.0, share) for ids, share in (shares | {("density",): 0.6, (): 0.31}).items()]
    assert leading(clear).effects == ("density",)


@pytest.mark.parametrize(("behind", "expected"), [(-1.0, ()), (10.0, ("density",)), (200.0, ("density",))])
def test_all_others_share_what_an_unknown_cause_loses(behind: float, expected: tuple[str, ...]) -> None:
    none = model((), 0.0)
    scores = {UNKNOWN: -0.2, ("density",): -2.0, (): -2.0 - behind}
    total = sum(np.exp(score) for score in scores.values())
    found = tuple(Weighed(ids, none, score, float(np.exp(score) / total)) for ids, score in scores.items())
    kept = with_refuted(found, {UNKNOWN}, none)
    assert leading(kept).effects == expected
    odds = {each.effects: each.probability for each in kept}
    assert odds["density",] / max(odds[()], 1e-300) == pytest.approx(np.exp(behind), rel=1e-6)
    assert sum(each.probability for each in kept) == pytest.approx(1.0)


def test_one_change_of_many_that_compete_has_their_mean_evidence() -> None:
    """A step of the tester that happens to fit at one of many places explains no more than one of many would."""
    none = model((), 1000.0)
    lucky = model((StepInTime(0.5, 1.0),), 960.0)
    found = {each.effects: each.probability for each in weigh(none, [lucky])}
    prior = UNCALIBRATED.counts[1] * UNCALIBRATED.local_share / UNCALIBRATED.counts[0] / CHANGES
    odds = prior * np.exp(log_evidence(lucky.fit) - log_evidence(none.fit))
    assert found[UNKNOWN] == pytest.approx(odds / (1 + odds), rel=1e-3)


class AnyFrame(FrameCompliance):
    """A smooth function in place of a law of the tester."""

    id = Mechanism.TESTER
    law_free = True


class AnyLoss(LossLaw):
    """A smooth function in place of a law of the joints."""

    id = Mechanism.JOINT_FREQUENCY
    law_free = True


def test_a_smooth_function_keeps_the_law_that_gives_its_name_however_far_behind() -> None:
    none, smooth = model((), 1e6, 9e5), model((AnyFrame(),), 1000.0)
    closest = model((FrameCompliance(),), 5e5, 4e5)
    kept = contenders(Contest(none, [smooth, closest, model((TransducerLag(),), 9e5, 8e5)], UNCALIBRATED))
    assert kept == [smooth, closest]
    best = leading(weigh(none, kept))
    assert best.effects == ("frame_compliance",)
    assert best.model is smooth


@pytest.mark.parametrize(
    ("law", "left", "score", "expected"),
    [
        (FixtureInertia(), 1e5, 1.0, ("fixture_inertia",)),
        (FixtureInertia(), 8e5, 1.0, UNKNOWN),
        (FrameCompliance(), 1e5, 1.0, ("frame_compliance",)),
        (FrameCompliance(), 8e5, 1.0, UNKNOWN),
        (FrameCompliance(), 1e5, 20.0, UNKNOWN),
        (LossLaw(), 8e5, 1.0, ("loss_law",)),
        (LossLaw(), 8e5, 20.0, UNKNOWN),
    ],
)
def test_a_smooth_function_has_the_name_of_rubber_however_badly_its_law_fits_and_of_no_law_far_beyond_its_range(
    law: Effect, left: float, score: float, expected: tuple[str, ...]
) -> None:
    none, smooth = model((), 1e6, 9e5), model((AnyLoss() if isinstance(law, LossLaw) else AnyFrame(),), 1000.0)
    best = leading(weigh(none, [smooth, model((law,), left + 1e5, left, score)]))
    assert best.effects == expected
    assert best.model is smooth


def test_no_cause_is_told_where_the_model_does_not_fit_and_nothing_mends_that() -> None:
    (sentence,) = unfit("the paper's model", 100.0, 97.0, "units")
    assert sentence.startswith("the paper's model does not fit at all (gap 100 %")
    assert sentence.endswith("check units")
    assert unfit("the paper's model", 250.0, 3.0, "units") == ()
    assert unfit("the paper's model", 60.0, 55.0, "units") == ()
