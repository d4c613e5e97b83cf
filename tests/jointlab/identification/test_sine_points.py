"""Sine points come back from the catalogue as analysis had them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from analysis.direct.corrections import TesterEffect, correct
from analysis.direct.dynamic_stiffness import DynamicStiffness, dynamic_stiffness
from analysis.interval import Estimate
from jointlab.identification.sine_points import IdentifiedSinePoint, sine_point, stored_point
from tests.analysis.direct.points import from_polar, independent_corrections

RATE = 2560.0


def measured() -> DynamicStiffness:
    """A point of a noisy record with a third harmonic, corrected for a frame that is known to 5 %."""
    rng = np.random.default_rng(3)
    wave = 5e-6 * np.exp(2j * np.pi * 50 * np.arange(1280) / RATE)
    force = (2.3e6 * (1 + 0.12j) * wave).real + 0.3 * np.cos(3 * np.angle(wave)) + 0.1 * rng.standard_normal(1280)
    raw = dynamic_stiffness(wave.real + 1e-8 * rng.standard_normal(1280), force, RATE, 50.0)
    frame = independent_corrections({TesterEffect.FRAME_COMPLIANCE: Estimate(3e-8, 1.5e-9)})
    return correct([raw], frame)[0]


def sine_point_of(result: DynamicStiffness) -> IdentifiedSinePoint:
    return IdentifiedSinePoint(
        "I", "shear", 0.01, 50.0, result, order_number=4, elapsed=2.5, temperature_c=23.0, sine_record_id=9
    )


@pytest.mark.parametrize("remark", ["mains hum of 50 Hz shifts k", "saturated force: 60 of 1280 samples"])
def test_a_remark_comes_back_and_other_shortcomings_are_not_doubled(remark: str) -> None:
    distorted = replace(measured(), thd_force=0.2, remarks=(remark,))
    assert sine_point(stored_point(sine_point_of(distorted))).result.shortcomings == distorted.shortcomings
    assert len(distorted.shortcomings) == 2


def test_a_measured_point_comes_back_with_all_of_its_errors() -> None:
    before = sine_point_of(measured())
    after = sine_point(stored_point(before))
    assert stored_point(before).frequency == 50.0 != before.result.frequency
    assert replace(after, result=before.result) == before
    one, other = before.result, after.result
    np.testing.assert_allclose(other.covariance, one.covariance, rtol=1e-12)
    assert other.shared_errors == one.shared_errors
    assert list(one.shared_errors)
    assert other.loop_energy_excess is not None
    assert one.loop_energy_excess is not None
    assert other.loop_energy_excess.value == one.loop_energy_excess.value
    for name in (
        "frequency", "amplitude_pp", "complex_stiffness", "degrees_of_freedom", "amplitude_pp_standard_error",
        "thd_displacement", "thd_displacement_standard_error", "thd_force", "thd_force_standard_error", "loop_energy",
    ):  # fmt: skip
        assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-12), name
    assert other.loop_energy_estimate == pytest.approx(one.loop_energy_estimate)
    assert other.shortcomings == one.shortcomings


def test_what_a_bundle_does_not_say_stays_unknown() -> None:
    stored = stored_point(sine_point_of(from_polar(50.0, 1e-5, 2e6, 0.1, 0.01, thd_force=0.004)))
    assert (stored.loop_energy, stored.loop_energy_se, stored.thd_se_percent) == (None, None, None)
    assert (stored.degrees_of_freedom, stored.reached_pp_se_mm, stored.shared_errors) == (None, None, {})
    back = sine_point(stored).result
    assert math.isinf(back.degrees_of_freedom)
    assert back.thd_force == pytest.approx(0.004)
    assert back.loop_energy_estimate is None


def test_a_point_without_a_reached_amplitude_is_taken_to_have_reached_its_own() -> None:
    stored = replace(stored_point(sine_point_of(measured())), reached_pp_mm=None)
    assert sine_point(stored).result.amplitude_pp == pytest.approx(1e-5)
