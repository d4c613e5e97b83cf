import cmath
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.direct.corrections import RigCorrections, TesterEffect, correct
from analysis.direct.dynamic_stiffness import DynamicStiffness, dynamic_stiffness
from analysis.direct.point_covariance import joint_covariance
from analysis.errors import AnalysisError
from analysis.interval import Estimate
from tests.analysis.direct.points import from_polar, independent_corrections, measured_stiffness

LAG, FRAME, INERTIA = TesterEffect.TRANSDUCER_LAG, TesterEffect.FRAME_COMPLIANCE, TesterEffect.FIXTURE_INERTIA
VALUES = {LAG: 100e-6, FRAME: 0.05e-6, INERTIA: 0.15}
ERRORS = {LAG: 2e-6, FRAME: 0.002e-6, INERTIA: 0.01}
TRUTH = 2.3e6 * (1 + 0.12j)


def known() -> RigCorrections:
    return independent_corrections({effect: Estimate(VALUES[effect], ERRORS[effect]) for effect in VALUES})


def measured(
    frequency: float, truth: complex = TRUTH, error: float = 0.001, values: dict[TesterEffect, float] | None = None
) -> DynamicStiffness:
    seen = measured_stiffness(truth, frequency, VALUES if values is None else values)
    return from_polar(frequency, 1e-5, abs(seen), math.atan2(seen.imag, seen.real), error)


@settings(max_examples=200, deadline=None)
@given(
    truth=st.complex_numbers(min_magnitude=1e4, max_magnitude=5e6).filter(lambda z: z.real > 0),
    frequency=st.floats(1, 300),
    lag=st.floats(-3e-4, 3e-4),
    compliance=st.floats(0, 0.15e-6),
    mass=st.floats(0, 0.2),
)
def test_correcting_undoes_what_the_rig_does(
    truth: complex, frequency: float, lag: float, compliance: float, mass: float
) -> None:
    values = {LAG: lag, FRAME: compliance, INERTIA: mass}
    corrections = independent_corrections({effect: Estimate(value, 0.0) for effect, value in values.items()})
    (found,) = correct([measured(frequency, truth, values=values)], corrections)
    scale = abs(truth) + mass * (2 * math.pi * frequency) ** 2
    assert found.complex_stiffness == pytest.approx(truth, abs=1e-9 * scale)


def test_each_effect_has_the_sign_that_its_law_says() -> None:
    omega = 2 * math.pi * 200
    assert measured_stiffness(TRUTH, 200, {INERTIA: 0.2}) == pytest.approx(TRUTH - omega**2 * 0.2)
    assert 1 / measured_stiffness(TRUTH, 200, {FRAME: 1e-7}) == pytest.approx(1 / TRUTH + 1e-7)
    assert measured_stiffness(TRUTH, 200, {LAG: 1e-4}) == pytest.approx(TRUTH * cmath.exp(1j * omega * 1e-4))


def test_a_displacement_that_is_late_is_corrected_from_its_record() -> None:
    rate, lag = 5000.0, 200e-6
    time = np.arange(2500) / rate
    wave, late = (50e-6 * np.exp(2j * np.pi * 100 * moment) for moment in (time, time - lag))
    point = dynamic_stiffness(late.real, (TRUTH * wave).real, rate, 100.0)
    (found,) = correct([point], independent_corrections({LAG: Estimate(lag, 0.0)}))
    assert point.loss_factor > 0.2
    assert found.complex_stiffness == pytest.approx(TRUTH, rel=1e-8)
    assert found.loop_energy == pytest.approx(math.pi * 50e-6**2 * TRUTH.imag, rel=1e-6)
    assert found.first_harmonic_sufficient


def test_the_specimen_moves_by_what_the_frame_leaves() -> None:
    point = replace(measured(50.0), amplitude_pp_standard_error=1e-7)
    (found,) = correct([point], known().only(FRAME))
    share = abs(1 - VALUES[FRAME] * point.complex_stiffness)
    assert found.amplitude_pp == pytest.approx(share * 1e-5)
    assert found.amplitude_pp_standard_error == pytest.approx(share * 1e-7)


def test_what_was_applied_is_recorded_with_its_error_and_unit() -> None:
    (found,) = correct([measured(50.0)], known().only(LAG, FRAME))
    assert [record.effect for record in found.corrections] == ["transducer_lag", "frame_compliance"]
    frame = found.corrections[1]
    assert (frame.parameter, frame.unit) == ("c", "m/N")
    assert (frame.value, frame.standard_error) == pytest.approx((5e-8, 2e-9))
    (again,) = correct([found], known().only(INERTIA))
    assert [record.parameter for record in again.corrections] == ["tau", "c", "m"]


def test_correcting_in_two_steps_or_in_one_is_the_same() -> None:
    points = [measured(frequency) for frequency in (20.0, 200.0)]
    at_once = correct(points, known())
    in_steps = correct(correct(points, known().only(LAG, FRAME)), known().only(INERTIA))
    for one, other in zip(at_once, in_steps, strict=True):
        assert other.complex_stiffness == pytest.approx(one.complex_stiffness)
        np.testing.assert_allclose(other.covariance, one.covariance, rtol=1e-9)
    np.testing.assert_allclose(joint_covariance(in_steps), joint_covariance(at_once), rtol=1e-9)


@pytest.mark.parametrize("effect", list(TesterEffect))
def test_a_parameter_that_is_wrong_by_its_error_moves_points_by_what_they_share(effect: TesterEffect) -> None:
    points = [measured(frequency) for frequency in (20.0, 200.0)]
    nudge = 1e-3
    wrong = {each: Estimate(value + nudge * ERRORS[each] * (each is effect), 0.0) for each, value in VALUES.items()}
    found, other = (correct(points, corrections) for corrections in (known(), independent_corrections(wrong)))
    source = f"rig {list(VALUES).index(effect) + 1}"
    for point, moved in zip(found, other, strict=True):
        shift = (moved.complex_stiffness - point.complex_stiffness) / nudge
        assert shift == pytest.approx(point.shared_errors[source], rel=1e-3)


def test_the_joint_covariance_is_that_of_repeated_calibrations() -> None:
    rng = np.random.default_rng(8)
    points = [measured(frequency) for frequency in (20.0, 100.0, 200.0)]
    spread = np.array([[4.0, 1.5, -0.5], [1.5, 2.0, 0.3], [-0.5, 0.3, 1.0]]) * np.outer(
        list(ERRORS.values()), list(ERRORS.values())
    )
    stated = joint_covariance(correct(points, RigCorrections.correlated(VALUES, spread, math.inf, "blank")))
    runs = []
    for draw in rng.multivariate_normal(list(VALUES.values()), spread, size=4000):
        exact = independent_corrections(
            {effect: Estimate(value, 0.0) for effect, value in zip(VALUES, draw, strict=True)}
        )
        noise = rng.standard_normal((3, 2)) @ [1, 1j]
        repeat = [
            replace(point, complex_stiffness=point.complex_stiffness + point.magnitude * 0.001 * error)
            for point, error in zip(points, noise, strict=True)
        ]
        runs.append([part for p in correct(repeat, exact) for part in (p.stiffness, p.damping)])
    observed = np.cov(np.transpose(runs))
    scale = np.sqrt(np.diag(stated))
    # a correlation from 4000 repeats is known to 1.6 %
    np.testing.assert_allclose(observed / np.outer(scale, scale), stated / np.outer(scale, scale), atol=0.06)


def test_an_error_that_all_points_share_does_not_average_out() -> None:
    points = correct([measured(frequency, error=0.0) for frequency in (50.0, 51.0, 52.0)], known().only(FRAME))
    covariance = joint_covariance(points)[::2, ::2]
    mean_error = math.sqrt(float(np.mean(covariance)))
    assert mean_error == pytest.approx(points[0].stiffness_estimate.standard_error, rel=0.01)


def test_points_from_two_calibrations_share_nothing() -> None:
    one, other = (
        correct([measured(50.0)], independent_corrections({FRAME: Estimate(1e-8, 1e-9)}, source=name))[0]
        for name in ("blank of May", "blank of June")
    )
    assert np.all(joint_covariance([one, other])[:2, 2:] == 0)


def test_a_frame_softer_than_the_specimen_is_refused() -> None:
    with pytest.raises(AnalysisError, match=r"takes .* of the motion"):
        correct([from_polar(50.0, 1e-5, 2e6, 0.1, 0.001)], independent_corrections({FRAME: Estimate(4e-7, 0.0)}))


def test_switching_off_what_is_not_there_is_refused() -> None:
    with pytest.raises(AnalysisError, match="fixture_inertia"):
        known().only(FRAME).only(INERTIA)


def test_parameters_that_are_no_numbers_are_refused() -> None:
    with pytest.raises(AnalysisError, match="finite"):
        independent_corrections({FRAME: Estimate(math.nan, 0.0)})
    with pytest.raises(AnalysisError, match="shape"):
        RigCorrections({FRAME: 0.0}, np.zeros((2, 2)))
