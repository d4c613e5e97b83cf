import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.direct.corrections import TesterEffect, correct
from analysis.direct.cylinder_terms import cylinder_terms, joint_terms, match_configurations
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex
from analysis.interval import Estimate
from analysis.structure.joints import Cylinder, joint_from_cylinders
from tests.analysis.direct.points import independent_corrections, measured_stiffness, point

A, B = 0.36e6 * (1 + 0.10j), 2.30e6 * (1 + 0.12j)
Series = list[DynamicStiffness]
stiffness = st.builds(lambda k, gamma: k * complex(1, gamma), st.floats(1e5, 1e7), st.floats(0.0, 0.5))


def measured(a: complex, b: complex, error: float = 0.01) -> tuple[Series, Series, Series]:
    """Compression, shear and angled without noise."""
    return [point(b, error)], [point(2 * a, error)], [point(a + b, error)]


@given(a=stiffness, b=stiffness)
def test_consistent_configurations_give_both_terms_exactly(a: complex, b: complex) -> None:
    (terms,) = cylinder_terms(*measured(a, b))
    assert terms.shear.complex_stiffness == pytest.approx(a, rel=1e-6)
    assert terms.compression.complex_stiffness == pytest.approx(b, rel=1e-6)
    assert terms.misfit == pytest.approx(0.0, abs=1e-9)


@given(a=stiffness, b=stiffness)
def test_exact_points_without_any_error_are_solved_too(a: complex, b: complex) -> None:
    (terms,) = cylinder_terms(*measured(a, b, error=0.0))
    assert terms.compression.complex_stiffness == pytest.approx(b, rel=1e-6)


@given(a=stiffness, b=stiffness, scale=st.floats(1e-3, 1e3))
def test_terms_scale_with_the_unit_of_force(a: complex, b: complex, scale: float) -> None:
    (plain,) = cylinder_terms(*measured(a, b))
    (scaled,) = cylinder_terms(*measured(scale * a, scale * b))
    assert scaled.shear.complex_stiffness == pytest.approx(scale * plain.shear.complex_stiffness, rel=1e-6)
    np.testing.assert_allclose(
        scaled.covariance, scale**2 * plain.covariance, rtol=1e-6, atol=1e-9 * scale**2 * np.max(plain.covariance)
    )


def test_the_angled_pair_narrows_the_shear_and_compression_terms() -> None:
    (terms,) = cylinder_terms(*measured(A, B))
    assert terms.shear.stiffness_estimate.standard_error < 0.01 * abs(A)
    assert terms.compression.stiffness_estimate.standard_error < 0.01 * abs(B)


def test_errors_cover_the_scatter_of_repeated_measurements() -> None:
    rng = np.random.default_rng(4)
    truth: Complex = np.array([B, 2 * A, A + B], dtype=np.complex128)

    def noisy() -> Complex:
        return np.asarray(truth * (1 + 0.01 * (rng.standard_normal(3) + 1j * rng.standard_normal(3))))

    solved = []
    for _ in range(600):
        one, pair, both = noisy()
        solved.append(cylinder_terms([point(one)], [point(pair)], [point(both)])[0])
    shear = np.array([terms.shear.stiffness for terms in solved])
    predicted = cylinder_terms(*measured(A, B))[0].shear.stiffness_estimate.standard_error
    assert np.std(shear) == pytest.approx(predicted, rel=0.09)  # 600 draws know it to 3 %
    assert np.mean(shear) == pytest.approx(A.real, abs=4 * predicted / math.sqrt(600))
    assert np.mean([terms.misfit for terms in solved]) == pytest.approx(1.0, abs=0.16)  # four times 1/sqrt(600)


def test_an_angled_pair_that_disagrees_widens_the_errors() -> None:
    compression, shear, _ = measured(A, B)
    (terms,) = cylinder_terms(compression, shear, [point(1.1 * (A + B))])
    (fair,) = cylinder_terms(*measured(A, B))
    assert terms.misfit > 10
    ratio = terms.compression.stiffness_estimate.standard_error / fair.compression.stiffness_estimate.standard_error
    assert ratio == pytest.approx(math.sqrt(terms.misfit), rel=0.1)


@given(a=stiffness, b=stiffness, degrees=st.floats(-180, 180))
def test_turning_the_cylinders_keeps_trace_and_determinant_of_the_joint(a: complex, b: complex, degrees: float) -> None:
    (terms,) = cylinder_terms(*measured(a, b))
    joint = joint_terms(terms, math.radians(degrees))
    k11, k22, k12 = (term.complex_stiffness for term in (joint.k11, joint.k22, joint.k12))
    assert k11 + k22 == pytest.approx(2 * (a + b), rel=1e-6)
    assert k11 * k22 - k12**2 == pytest.approx(4 * a * b, rel=1e-5, abs=1e-9 * abs(a + b) ** 2)


@pytest.mark.parametrize(("degrees", "sign"), [(-45, 1), (135, 1), (45, -1), (-135, -1)])
def test_coupling_is_positive_as_at_joint_one_and_negative_as_at_joint_two(degrees: float, sign: int) -> None:
    (terms,) = cylinder_terms(*measured(A, B))
    joint = joint_terms(terms, math.radians(degrees))
    assert joint.k11.complex_stiffness == pytest.approx(A + B, rel=1e-6)
    assert joint.k22.complex_stiffness == pytest.approx(A + B, rel=1e-6)
    assert joint.k12.complex_stiffness == pytest.approx(sign * (B - A), rel=1e-6)


@pytest.mark.parametrize(("lower", "upper"), [(-45.0, 45.0), (-45.0, 135.0), (-30.0, 60.0), (20.0, -20.0)])
def test_each_cylinder_of_a_joint_has_its_own_inclination(lower: float, upper: float) -> None:
    angles = math.radians(lower), math.radians(upper)
    (terms,) = cylinder_terms(*measured(A, B))
    found = joint_terms(terms, angles[0], upper=angles[1])
    expected = joint_from_cylinders("I", 1, 2 * [Cylinder(A, B)], angles, 0.0).dynamic_stiffness
    assert found.k11.complex_stiffness == pytest.approx(expected[0, 0], rel=1e-6)
    assert found.k22.complex_stiffness == pytest.approx(expected[1, 1], rel=1e-6)
    assert found.k12.complex_stiffness == pytest.approx(expected[0, 1], rel=1e-6, abs=1.0)


def test_errors_of_joint_terms_count_the_correlation_of_the_cylinder_terms() -> None:
    (terms,) = cylinder_terms(*measured(A, B))
    joint = joint_terms(terms, -math.pi / 4)
    covariance = terms.covariance
    expected = covariance[0, 0] + covariance[2, 2] + 2 * covariance[0, 2]
    assert joint.k11.covariance[0, 0] == pytest.approx(expected)
    assert covariance[0, 2] < 0
    assert joint.k12.covariance[0, 0] > joint.k11.covariance[0, 0]


def test_points_are_matched_by_frequency_and_reached_amplitude() -> None:
    angled = [point(A + B, amplitude_pp=1e-4), point(A + B, amplitude_pp=1e-5), point(A + B, frequency=55.0)]
    compression = [point(B, amplitude_pp=1.03e-5), point(B, amplitude_pp=0.98e-4), point(B, frequency=50.1)]
    shear = [point(2 * A, amplitude_pp=0.99e-4), point(2 * A, amplitude_pp=0.97e-5)]
    triples = match_configurations(compression, shear, angled)
    assert [triple.compression.amplitude_pp for triple in triples] == [0.98e-4, 1e-5]
    assert [triple.angled for triple in triples] == angled[:2]


def test_series_without_a_common_point_are_refused() -> None:
    compression, shear, angled = measured(A, B)
    with pytest.raises(AnalysisError, match="0, 1 and 1 points"):
        match_configurations([], shear, angled)
    with pytest.raises(AnalysisError, match="no frequency and amplitude"):
        cylinder_terms(compression, shear, [point(A + B, frequency=80.0)])


def test_a_frame_that_is_not_known_well_widens_the_terms_and_is_passed_on() -> None:
    corrections = independent_corrections({TesterEffect.FRAME_COMPLIANCE: Estimate(2e-8, 2e-9)})
    series = [[point(measured_stiffness(truth, 50.0, corrections.values), 1e-6)] for truth in (B, 2 * A, A + B)]
    (terms,) = cylinder_terms(*(correct(points, corrections) for points in series))
    assert terms.compression.complex_stiffness == pytest.approx(B, rel=1e-5)
    # dk = k^2 dc, in every configuration at once
    assert terms.compression.stiffness_estimate.standard_error > 0.3 * abs(B) ** 2 * 2e-9
    (shared,) = terms.compression.shared_errors.values()
    assert abs(shared) == pytest.approx(np.sqrt(np.trace(terms.compression.covariance)), rel=1e-2)
    assert [record.parameter for record in terms.shear.corrections] == ["c"]
    joint = joint_terms(terms, -np.pi / 4)
    assert set(joint.k12.shared_errors) == set(terms.shear.shared_errors)
