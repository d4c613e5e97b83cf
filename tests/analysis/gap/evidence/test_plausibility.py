"""Sizes beyond their range and impossible ones speak for another cause, unless they take up the error of a law."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.effects.beam import AccelerometerMass
from analysis.gap.effects.joint_amplitude import AmplitudeDependence
from analysis.gap.effects.measuring_chain import ChannelDelay
from analysis.gap.effects.tester import VaryingLag
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.contest import Contest
from analysis.gap.evidence.model_evidence import overdispersed
from analysis.gap.evidence.plausibility import implausibility, impossibility
from analysis.gap.evidence.verdict import UNKNOWN, Weighed, leading
from analysis.gap.evidence.verdict import weigh as weigh_with
from analysis.gap.fitting.model import Model
from tests.analysis.gap.evidence.stated_models import model


def weigh(none: Model, models: list[Model]) -> tuple[Weighed[Model], ...]:
    return weigh_with(none, models, UNCALIBRATED)


@pytest.mark.parametrize(("place", "counts"), [(0, True), (1, False)], ids=["its size", "a bend of its law"])
def test_a_law_of_another_form_than_expected_is_no_cause_in_no_catalogue(place: int, counts: bool) -> None:
    lag = model((VaryingLag(),), 1000.0)
    scores = np.zeros(len(VaryingLag().parameters))
    scores[place] = 12.0
    strained = replace(lag, fit=replace(lag.fit, scores=scores))
    assert (implausibility(strained) > 0.0) is counts


@pytest.mark.parametrize(
    ("name", "left", "counts"),
    [("k0_over_kinf", 0.0, True), ("m", 0.0, False), ("m", 500.0, True)],
    ids=["its size", "its exponent, and nothing is left", "its exponent, and something is left"],
)
def test_an_exponent_beyond_its_range_is_another_form_of_the_law_where_that_leaves_nothing(
    name: str, left: float, counts: bool
) -> None:
    softer = model((AmplitudeDependence(),), 1000.0, left)
    scores = np.zeros(len(softer.effects[0].parameters))
    scores[[each.name for each in softer.effects[0].parameters].index(name)] = 12.0
    assert (implausibility(replace(softer, fit=replace(softer.fit, scores=scores))) > 0.0) is counts


@pytest.mark.parametrize(
    ("leaves", "effects"),
    [(4000.0, ("amplitude_dependence",)), (40_000.0, ("amplitude_dependence", "channel_delay"))],
    ids=["as much as without", "more than laws of the right kind"],
)
def test_sizes_that_take_up_the_error_of_their_own_law_are_those_of_the_fit_with_overdispersion(
    leaves: float, effects: tuple[str, ...]
) -> None:
    """Else a further effect of no size is named, beside which the same law happened to end within its range."""
    none, gap, left = model((), 1_001_000.0, 1_000_000.0), 1000.0, 4000.0
    beside_nothing = model((AmplitudeDependence(), ChannelDelay()), gap + left, left, score=0.1)
    stretched = model((AmplitudeDependence(),), gap + left, left, score=25.0)
    overdispersion = Contest(none, [stretched, beside_nothing], UNCALIBRATED).overdispersion
    again = overdispersed(model((AmplitudeDependence(),), gap + leaves, left, score=0.1).fit, overdispersion)
    models = [replace(stretched, overdispersed_fit=again), beside_nothing]
    assert leading(weigh(none, models)).effects == effects


def test_a_size_far_beyond_its_range_speaks_for_a_cause_in_no_catalogue() -> None:
    none = model((), 4000.0, 3000.0)
    assert leading(weigh(none, [model((AccelerometerMass(),), 1000.0, score=1.0)])).effects == ("accelerometer_mass",)
    assert leading(weigh(none, [model((AccelerometerMass(),), 1000.0, score=8.0)])).effects == UNKNOWN


@pytest.mark.parametrize(("score", "expected"), [(-0.02, ("accelerometer_mass",)), (-0.1, UNKNOWN)])
def test_a_mass_below_zero_speaks_for_a_cause_in_no_catalogue_where_it_is_no_chance(
    score: float, expected: tuple[str, ...]
) -> None:
    """One is known to a hundredth of its range: two standard deviations below zero are chance, ten are none."""
    none = model((), 4000.0, 3000.0)
    assert leading(weigh(none, [model((AccelerometerMass(),), 1000.0, score=score)])).effects == expected


def test_a_mass_is_not_impossible_because_it_is_large() -> None:
    assert impossibility(model((AccelerometerMass(),), 1000.0, score=1.9).fit) == 0.0
