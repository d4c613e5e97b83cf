"""Verdicts where no law of the catalogue is what the bench follows, and where an effect is hardly there."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from analysis.gap.bench import BeamBench, Cylinders, Loading, Setting
from analysis.gap.effect import Effect, Given, Mechanism
from analysis.gap.effects.beam import Density
from analysis.gap.effects.blow import ImpactAngle
from analysis.gap.effects.joint_amplitude import SaturatingStiffness, deformation
from analysis.gap.effects.joint_state import PreloadStiffening
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.verdict import UNKNOWN, Weighed, leading, weigh
from analysis.gap.fitting.model import Model
from analysis.gap.measurement import Measurement
from analysis.gap.search.forward_selection import selected
from tests.analysis.gap.conftest import Made, search_among

LINES = 32
"""Of each set, enough to see a mode."""


@dataclass(frozen=True)
class Unsteady(ImpactAngle):
    """Blows lean by a mean angle, with a skewed scatter from point to point."""

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        random = np.random.default_rng(5)
        by_point = {str(dof): 1.2 * random.exponential() for dof in dict.fromkeys(setting.inputs)}
        lean = [given["angle_deg"] + by_point[str(dof)] for dof in setting.inputs]
        return replace(bench, lean=bench.lean + np.radians(lean))


class MostlyCompressed(PreloadStiffening):
    """The preset stiffens what is compressed, and shear hardly at all; its loss rises by less."""

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        if not loading.tester:
            return cylinders
        more = given["s"] * self.preset_mm * np.where(loading.angled, 0.6, np.array([0.1, 1.0, 1.0])[:, None, None])
        return cylinders.scaled(1 + more, 1 + 0.3 * more)


class ByAnotherPower(SaturatingStiffness):
    """Stiffness changes with a power of amplitude of 1.2, not with its square."""

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        grown = (deformation(loading, given, True) / 50e-6) ** 1.2
        return cylinders.scaled(1 + 0.25 * grown / (1 + grown / 2), 1.0)


def verdict(measurement: Measurement, tried: set[str]) -> Weighed[Model]:
    search = search_among(measurement.thinned(LINES), tried)
    none = search.fit_paper_model()
    return leading(weigh(none, selected(search, none, UNCALIBRATED), UNCALIBRATED, left_out=True))


def test_blows_that_lean_by_no_law_are_leaning_blows(made: Made) -> None:
    """They were an unknown cause, as one angle for all blows left a tenth of the gap."""
    found = verdict(made((Unsteady(),), (1.0,)), {"impact_angle", "cross_axis_sensitivity", "sensor_gain"})
    assert found.effects == ("impact_angle",)


def test_a_spring_that_hardens_by_another_power_is_one_effect_and_not_two(made: Made) -> None:
    """It was two effects of one mechanism, each a law that one of them alone did not follow."""
    found = verdict(made((ByAnotherPower(),)), {"cubic_stiffness", "amplitude_dependence", "preload_stiffening"})
    assert [each.mechanism for each in found.model.effects] == [Mechanism.JOINT_AMPLITUDE]
    assert found.model.clean


def test_preload_that_acts_on_one_configuration_more_than_on_others_is_no_amplitude(made: Made) -> None:
    """It was an effect of amplitude that had a free factor for each configuration."""
    effect: Effect = MostlyCompressed(0.5)
    measurement = made((effect,), (0.8,))
    found = verdict(measurement, {"preload_stiffening", "amplitude_dependence", "temperature_shift"})
    assert found.effects == ("preload_stiffening",)


def test_gains_that_differ_by_configuration_are_nobodys_effect(made: Made) -> None:
    """They were two effects of amplitude at 0.998, as a free factor for each configuration took them up."""
    measurement = made()
    points = measurement.points
    assert points is not None
    gains = 1 + 0.02 * np.array([1.0, -1.2, 0.4])
    measurement = replace(measurement, points=replace(points, stiffness=points.stiffness * gains[points.configuration]))
    assert verdict(measurement, {"amplitude_dependence", "cubic_stiffness", "frame_compliance"}).effects == ()


@pytest.mark.parametrize("score", [0.2, 0.5])
def test_a_density_that_hardly_shows_is_no_unknown_cause(made: Made, score: float) -> None:
    found = verdict(made((Density(),), (score,)), {"density", "youngs_modulus", "joint_mass", "accelerometer_mass"})
    assert found.effects != UNKNOWN
