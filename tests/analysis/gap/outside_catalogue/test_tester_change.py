"""A step of the tester's reading: the right response, and the answer that no effect of the catalogue caused it."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.effects.joint_state import ConditioningDrift
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.plausibility import CHANCE
from analysis.gap.evidence.verdict import UNKNOWN, leading, weigh
from analysis.gap.findings.intervals import estimates
from analysis.gap.measurement import Configuration, Measurement
from analysis.gap.outside_catalogue.local_change import SETTINGS
from analysis.gap.outside_catalogue.tester_change import (
    KINDS,
    ReadingAtOneSetting,
    StepInTime,
    StepWithForce,
    TesterStep,
    changes_of_tester,
)
from analysis.gap.search.forward_selection import selected
from tests.analysis.gap.conftest import Made, search_among

CATALOGUE = {"conditioning_drift", "frame_compliance", "amplitude_dependence"}


@pytest.mark.parametrize("kind", [StepInTime, StepWithForce], ids=["time", "force"])
def test_a_step_that_resembles_the_catalogue_is_unknown_and_placed(
    made: Made, empty: Measurement, kind: type[TesterStep]
) -> None:
    true = kind.variants(empty)[3]
    search = replace(search_among(made((true,), (0.8, 0.3, 0.2)), CATALOGUE), rivals=changes_of_tester(empty))
    none = search.fit_paper_model()
    verdict = leading(weigh(none, selected(search, none, UNCALIBRATED), UNCALIBRATED))
    assert verdict.effects == UNKNOWN
    assert type(verdict.model.effects[0]) is kind
    found = estimates(verdict.model, UNCALIBRATED)[0]
    assert found["gain"].value == pytest.approx(0.04, rel=0.2)


def test_a_reading_of_one_setting_that_resembles_a_law_of_amplitude_is_unknown(made: Made, empty: Measurement) -> None:
    """Kraus' law fits it with an exponent that no rubber has, and without any amplitude dependence in shear."""
    true = ReadingAtOneSetting.variants(empty)[2]
    assert true.configuration == Configuration.COMPRESSION
    search = replace(search_among(made((true,), (2.5, 0.3)), CATALOGUE), rivals=changes_of_tester(empty))
    none = search.fit_paper_model()
    found = selected(search, none, UNCALIBRATED)
    law = next(each for each in found if each.ids == ("amplitude_dependence",))
    assert law.misfit.significance < CHANCE
    verdict = leading(weigh(none, found, UNCALIBRATED))
    assert verdict.effects == UNKNOWN
    assert verdict.model.effects == (true,)
    assert estimates(verdict.model, UNCALIBRATED)[0]["gain"].value == pytest.approx(0.125, rel=0.1)


def test_a_setting_alone_of_its_configuration_is_no_change_as_its_gain_is_a_tolerance(empty: Measurement) -> None:
    points = empty.points
    assert points is not None
    assert len(ReadingAtOneSetting.variants(empty)) == SETTINGS
    largest = points.amplitude == np.max(points.amplitude)
    assert ReadingAtOneSetting.variants(replace(empty, points=points.only(largest))) == ()


def test_a_reading_of_one_setting_changes_its_points_alone(empty: Measurement) -> None:
    points = empty.points
    assert points is not None
    setting = ReadingAtOneSetting.variants(empty)[4]
    ratio = setting.tester({"gain": 0.1, "phase": 0.0}, points.stiffness, points) / points.stiffness
    here = (points.configuration == setting.configuration) & (points.amplitude == setting.amplitude)
    assert np.allclose(ratio, np.where(here, 1.1, 1.0))


def test_a_drift_is_named_although_a_step_resembles_it(made: Made, empty: Measurement) -> None:
    search = search_among(made((ConditioningDrift(),), (0.8, 0.0)), CATALOGUE)
    none = search.fit_paper_model()
    steps = search.fitted_everywhere(none, changes_of_tester(empty), known=[none])
    weighed = weigh(none, [*selected(search, none, UNCALIBRATED), *steps], UNCALIBRATED)
    assert leading(weighed).effects == ("conditioning_drift",)


@pytest.mark.parametrize("kind", KINDS)
def test_a_step_changes_the_points_beyond_it_alone(empty: Measurement, kind: type[TesterStep]) -> None:
    assert empty.points is not None
    step = kind.variants(empty)[0]
    given = {"gain": 0.1, "phase": 0.0, "from": step.at}
    ratio = step.tester(given, empty.points.stiffness, empty.points) / empty.points.stiffness
    condition, far = kind.condition(empty.points), 0.25 * step.reach
    low, high = (step.at * np.exp(side * far) if kind.by_ratio else step.at + side * far for side in (-1, 1))
    assert np.allclose(ratio[condition > high], 1.1, atol=1e-3)
    assert np.allclose(ratio[condition < low], 1.0, atol=1e-3)


def test_no_step_is_sought_where_no_tester_was_used(empty: Measurement) -> None:
    assert changes_of_tester(replace(empty, points=None)) == ()
