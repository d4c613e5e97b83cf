"""Several effects on benches that follow the search's own model."""

from collections.abc import Callable, Sequence
from functools import partial
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from analysis.frequency_response import Complex
from analysis.gap.effect import Given, Mechanism
from analysis.gap.effects.attachment import FoundationCompliance, JointMass
from analysis.gap.effects.beam import AccelerometerMass
from analysis.gap.effects.measuring_chain import ChannelDelay
from analysis.gap.effects.tester import FilteredDisplacement, FrameCompliance, VaryingLag
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.verdict import Weighed, included, leading, weigh
from analysis.gap.findings.effects_found import effects_found, mechanisms_found
from analysis.gap.fitting.fit import evaluated, fit
from analysis.gap.fitting.model import Model
from analysis.gap.measurement import Measurement, TesterPoints
from analysis.gap.search.forward_selection import ForwardSelection, selected
from analysis.gap.search.screening import gain_by_linear_step
from analysis.gap.search.single_effects import Item, Result, Search, serial_map
from tests.analysis.gap.conftest import Made, search_among
from tests.analysis.gap.evidence.stated_models import model

TRIED = {"accelerometer_mass", "frame_compliance", "joint_mass", "temperature_shift", "channel_delay", "sensor_gain"}
LINES = 42
"""Of each set, enough to see a mode."""


def alone(search: Search, effect: AccelerometerMass | FrameCompliance | JointMass, none: Model) -> Model:
    """An effect by itself, wherever its fit ends."""
    start = np.insert(none.fit.scores, len(search.baseline.parameters), 0.1)
    return Model((effect,), fit(search.simulation((effect,)), start))


def selection(measurement: Measurement, tried: set[str]) -> ForwardSelection:
    search = search_among(measurement, tried)
    return ForwardSelection(search, search.fit_paper_model(), UNCALIBRATED)


def test_both_of_a_pair_are_named(made: Made) -> None:
    search = search_among(made((JointMass(), FrameCompliance()), (1.0, 0.6)).thinned(LINES), TRIED)
    none = search.fit_paper_model()
    so_far = list[Weighed[Model]]()
    weighed = weigh(none, selected(search, none, UNCALIBRATED, so_far.append), UNCALIBRATED)
    assert set(leading(weighed).effects) == {"joint_mass", "frame_compliance"}
    assert set(so_far[1].effects) == {"joint_mass", "frame_compliance"}, "told before the search ends"


def test_three_effects_are_each_included(made: Made) -> None:
    search = search_among(made((JointMass(), FrameCompliance(), ChannelDelay()), (0.8, 0.6, 0.5)).thinned(LINES), TRIED)
    none = search.fit_paper_model()
    weighed = weigh(none, selected(search, none, UNCALIBRATED), UNCALIBRATED)
    assert set(leading(weighed).effects) == {"joint_mass", "frame_compliance", "channel_delay"}
    sure = included(weighed)
    assert min(sure[each] for each in leading(weighed).effects) > 0.5


def test_a_single_effect_gets_no_second(made: Made) -> None:
    search = search_among(made((FrameCompliance(),), (0.6,)).thinned(LINES), TRIED)
    none = search.fit_paper_model()
    weighed = weigh(none, selected(search, none, UNCALIBRATED), UNCALIBRATED)
    assert leading(weighed).effects == ("frame_compliance",)


def test_nothing_is_sought_beside_an_effect_that_gains_next_to_nothing(made: Made) -> None:
    search, screened = search_among(made((), ()).thinned(LINES), TRIED), list[int]()

    def counting(work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
        if isinstance(work, partial) and work.func is gain_by_linear_step:
            screened.append(len(items))
        return serial_map(work, items)

    search.parallel_map = counting
    selected(search, search.fit_paper_model(), UNCALIBRATED)
    assert len(screened) == 1


def test_of_two_fits_of_one_effect_the_better_one_is_what_is_left_of_a_pair(made: Made) -> None:
    found = selection(made((JointMass(), FrameCompliance()), (1.0, 0.6)).thinned(LINES), TRIED)
    best = alone(found.search, FrameCompliance(), found.none)
    worse = Model(best.effects, evaluated(best.fit.likelihood, 0.9 * best.fit.scores))
    found.visited += [best, worse]
    pair = found.search.simulation((FrameCompliance(), JointMass()))
    both = Model(pair.effects, fit(pair, np.insert(best.fit.scores, len(found.search.baseline.parameters) + 1, 0.1)))
    mass, rest = found.fit_without_each(both)
    assert mass.effects == (JointMass(),)
    assert rest is best
    assert found.visited[2:] == [mass], "what was visited is not fitted again"


@pytest.mark.parametrize(("size", "gives_way"), [(2.5, False), (7.0, True)])
def test_only_a_size_far_outside_its_range_gives_way_to_another_fit_of_the_effect(
    made: Made, size: float, gives_way: bool
) -> None:
    found = selection(made((AccelerometerMass(),), (size,)).thinned(LINES), {"accelerometer_mass"})
    outside, place = alone(found.search, AccelerometerMass(), found.none), len(found.search.baseline.parameters)
    scores = outside.fit.scores.copy()
    scores[place] = 1.0
    inside = Model(outside.effects, evaluated(outside.fit.likelihood, scores))
    found.visited += [outside, inside]
    assert outside.log_evidence > inside.log_evidence
    assert found.within_range(outside) is (inside if gives_way else outside)


def test_a_fit_that_ended_in_a_poorer_minimum_goes_on_from_where_a_companion_led(made: Made) -> None:
    found = selection(made((JointMass(), FrameCompliance()), (0.1, 0.6)).thinned(LINES), TRIED)
    best = alone(found.search, FrameCompliance(), found.none)
    worse = Model(best.effects, evaluated(best.fit.likelihood, 0.5 * best.fit.scores))
    pair = found.search.simulation((FrameCompliance(), JointMass()))
    both = Model(pair.effects, fit(pair, np.insert(best.fit.scores, len(found.search.baseline.parameters) + 1, 0.1)))
    found.visited += [worse, both]
    found.fit_again(1)
    (again,) = found.visited[2:]
    assert again.effects == worse.effects
    assert abs(again.fit.at.cost - best.fit.at.cost) < 2.0
    found.fit_again(1)
    assert found.visited[3:] == [], "of a model whose own fit is the better one nothing is fitted again"


def test_what_hides_behind_a_wrong_effect_is_found_when_that_is_taken_out(made: Made) -> None:
    """The foundation is fitted alone after a pair has shown it, and then the frame is tried beside it."""
    measurement = made((FoundationCompliance(1), FrameCompliance()), (0.8, 0.0, 0.5, 0.4))
    found = selection(measurement, {"accelerometer_mass", "foundation_compliance", "frame_compliance"})
    wrong = alone(found.search, AccelerometerMass(), found.none)
    found.visited.append(wrong)
    found.add_to(wrong)
    found.exchange(max((each for each in found.visited if len(each.effects) == 2), key=lambda each: each.log_evidence))
    best = max(found.visited, key=lambda each: each.log_evidence)
    assert set(best.ids) == {"foundation_compliance", "frame_compliance"}
    assert best.clean
    assert any(each.ids == ("foundation_compliance",) for each in found.visited)


def test_further_effects_are_added_to_the_best_pair_and_to_the_most_probable_one(empty: Measurement) -> None:
    """Sizes moved far off make a wrong pair the best by a little; with laws of inexact form they cost more."""
    mass, delay, frame = JointMass(), ChannelDelay(), FrameCompliance()
    best, probable = model((mass, delay), 84_000.0, 70_000.0, score=12.0), model((mass, frame), 86_000.0, 70_000.0)
    third = model((delay, frame), 90_000.0, 70_000.0)
    found = ForwardSelection(search_among(empty, TRIED), model((), 1.2e6, 1.2e6), UNCALIBRATED)
    found.visited += [model((mass,), 140_000.0, 120_000.0), third, probable, best]
    assert best.log_evidence > probable.log_evidence
    assert found.to_extend(2) == [best, probable]
    found.visited.remove(best)
    assert found.to_extend(2) == [probable], "once, where both are the same"


def test_another_effect_may_take_a_place_in_an_explanation_that_leaves_nothing(made: Made) -> None:
    measurement = made((JointMass(), FrameCompliance()), (1.0, 0.6)).thinned(LINES)
    found = selection(measurement, {"joint_mass", "frame_compliance", "transducer_lag"})
    mass, frame = JointMass(), FrameCompliance()
    found.visited.append(alone(found.search, mass, found.none))
    pair = found.search.simulation((mass, frame))
    start = np.insert(found.visited[0].fit.scores, len(found.search.baseline.parameters) + 1, 0.1)
    both = Model(pair.effects, fit(pair, start))
    assert both.clean
    found.exchange(both)
    assert {"joint_mass", "transducer_lag"} in [set(each.ids) for each in found.visited]


def test_of_the_second_effect_every_law_is_tried(made: Made) -> None:
    measurement = made((FrameCompliance(), FilteredDisplacement()), (0.6, 0.8)).thinned(LINES)
    found = selection(measurement, {"frame_compliance", "transducer_lag"})
    found.run()
    pairs = [each for each in found.visited if len(each.effects) == 2]
    laws = {effect.law for each in pairs for effect in each.effects if effect.id == "transducer_lag"}
    assert laws == {"delay", FilteredDisplacement.law, VaryingLag.law}


class AnyFrame(FrameCompliance):
    """The tester in place of a law: it leads its mechanism, and no law of it is fitted in these tests."""

    id = "tester"
    law = "smooth function"
    law_free = True


class StiffFrame(FrameCompliance):
    """A wrong law: compliance grows with frequency."""

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return np.asarray(1 / (1 / stiffness + given["c"] * (points.frequency / 100.0) ** 0.1))


def test_a_mechanism_whose_law_does_not_fit_is_named_with_its_closest_effect(made: Made) -> None:
    search = search_among(made((FrameCompliance(),), (0.8,)).thinned(LINES), {"joint_mass"})
    search.candidates = (*search.candidates, StiffFrame())
    search.law_free = (AnyFrame(),)
    none = search.fit_paper_model()
    weighed = weigh(none, selected(search, none, UNCALIBRATED), UNCALIBRATED)
    verdict = leading(weighed)
    assert verdict.effects == ("frame_compliance",)
    assert verdict.laws == ("smooth function",)
    assert verdict.model.clean
    (found,) = [each for each in effects_found(weighed, UNCALIBRATED) if each.id == "frame_compliance"]
    assert not found.law_is_known
    assert found.probability > 0.5
    assert mechanisms_found(weighed)[Mechanism.TESTER] > 0.9


def test_a_mechanism_without_a_law_is_fitted_before_further_effects_take_up_what_a_law_leaves(made: Made) -> None:
    found = selection(made((FrameCompliance(),), (0.8,)).thinned(LINES), {"joint_mass", "channel_delay"})
    found.search.candidates = (*found.search.candidates, StiffFrame())
    found.search.law_free = (AnyFrame(),)
    found.run()
    order = [each.ids for each in found.visited]
    first_pair = next((place for place, ids in enumerate(order) if len(ids) == 2), len(order))
    assert order.index(("tester",)) < first_pair


def test_where_nothing_is_to_be_found_the_best_candidates_are_tried_all_the_same(made: Made) -> None:
    search = search_among(made().thinned(LINES), {"frame_compliance", "joint_mass", "channel_delay"})
    none = search.fit_paper_model()
    tried = {name for each in selected(search, none, UNCALIBRATED) for name in each.ids}
    assert len(tried) >= 2


def test_causes_in_no_catalogue_compete_with_one_law_that_leaves_nothing_and_not_with_no_effect() -> None:
    none, one, weak = model((), 1000.0), model((JointMass(),), 1000.0), model((JointMass(),), 950.0)
    for each in (none, one):
        each.__dict__["clean_in_tester"] = True
    rivals = (JointMass(),)
    chosen = ForwardSelection(cast(Search, SimpleNamespace(rivals=rivals)), none, UNCALIBRATED)
    assert one.clean
    assert chosen._rivals_of(one) == rivals
    assert chosen._rivals_of(none) == ()
    chosen.visited.append(one)
    assert chosen._rivals_of(none) == (), "an effect that costs more than it gains shows nothing"
    chosen.visited.append(weak)
    assert chosen._rivals_of(none) == rivals, "what is more probable than its absence may be a cause in no catalogue"
