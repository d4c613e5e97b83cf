import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.errors import AnalysisError
from analysis.structure.beam import Beam
from analysis.structure.joints import (
    Cylinder,
    Joint,
    effective_stiffness,
    inclined_support,
    joint_from_cylinders,
    least_loss,
)

stiffness = st.floats(1e4, 1e7)
angle = st.floats(-np.pi, np.pi)
loss = st.floats(0.0, 0.3)


def test_two_opposed_cylinders_give_equation_11() -> None:
    a, b, c, d, e = 0.36e6, 2.3e6, 20.0, 900.0, 0.006
    joint = joint_from_cylinders("I", 2, 2 * [Cylinder(a, b, c, d)], np.radians([45, -135]), e)
    rotation = 2 * c + 2 * np.sqrt(2) * e * d + e**2 * (a + b)
    expected = np.array([[a + b, a - b, 0], [a - b, a + b, 0], [0, 0, rotation]])
    np.testing.assert_allclose(joint.dynamic_stiffness, expected, atol=1e-8 * b)


def test_the_sign_of_k12_follows_the_way_the_cylinders_lean() -> None:
    pair = 2 * [Cylinder(0.36e6, 2.3e6)]
    left = joint_from_cylinders("I", 2, pair, np.radians([-45, 135]), 0.006).dynamic_stiffness
    right = joint_from_cylinders("II", 10, pair, np.radians([45, -135]), 0.006).dynamic_stiffness
    assert left[0, 1].real == pytest.approx(1.94e6)
    assert right[0, 1].real == pytest.approx(-1.94e6)


def test_unlike_cylinders_couple_translation_and_rotation() -> None:
    pair = [Cylinder(0.36e6, 2.3e6), Cylinder(0.40e6, 2.3e6)]
    joint = joint_from_cylinders("I", 2, pair, np.radians([-45, 135]), 0.006)
    assert abs(joint.dynamic_stiffness[0, 2]) == pytest.approx(0.006 * 0.02e6)


@given(a=stiffness, b=stiffness, c=st.floats(0, 100), theta=angle, e=st.floats(-0.02, 0.02), x=angle, y=angle, r=angle)
def test_a_motion_stores_the_same_energy_seen_from_node_and_cylinder(
    a: float, b: float, c: float, theta: float, e: float, x: float, y: float, r: float
) -> None:
    cylinder = Cylinder(a, b, c)
    node = np.array([x, y, r])
    end = np.array([x - e * r, y, r])  # the rigid arm between them
    local = np.array(
        [np.cos(theta) * end[0] + np.sin(theta) * end[1], -np.sin(theta) * end[0] + np.cos(theta) * end[1], r]
    )
    seen_from_node = node @ effective_stiffness(cylinder, theta, e).real @ node
    assert seen_from_node == pytest.approx(local @ cylinder.matrix.real @ local, rel=1e-9, abs=1e-6)


def test_a_support_at_45_degrees_is_equation_16(paper_beam: Beam) -> None:
    k_bar, ratio = 40.0, 7.0
    half = k_bar * paper_beam.flexural_rigidity / (2 * paper_beam.length**3)
    expected = half * np.array([[ratio + 1, ratio - 1, 0], [ratio - 1, ratio + 1, 0], [0, 0, 0]])
    left = inclined_support(paper_beam, "I", 2, k_bar, ratio, np.pi / 4)
    right = inclined_support(paper_beam, "II", 10, k_bar, ratio, -np.pi / 4)
    np.testing.assert_allclose(left.dynamic_stiffness, expected, atol=1e-9 * half)
    np.testing.assert_allclose(
        right.dynamic_stiffness, expected * [[1, -1, 1], [-1, 1, 1], [1, 1, 1]], atol=1e-9 * half
    )


@given(theta=angle, ratio=st.floats(0.5, 20.0))
def test_an_inclined_support_follows_equations_13_to_15(theta: float, ratio: float) -> None:
    beam = Beam(0.914, 0.0254, 0.0508, 207e9, 0.3, 7850.0)
    found = (
        inclined_support(beam, "I", 2, 1.0, ratio, theta, rotation_ratio=0.5).dynamic_stiffness / beam.stiffness_unit
    )
    c, s = np.cos(theta), np.sin(theta)
    expected = np.array(
        [[ratio * c**2 + s**2, (ratio - 1) * s * c, 0], [(ratio - 1) * s * c, ratio * s**2 + c**2, 0], [0, 0, 0.5]]
    )
    np.testing.assert_allclose(found, expected, atol=1e-12 * ratio)


@given(a=stiffness, b=stiffness, shear_loss=loss, compression_loss=loss, theta=angle, e=st.floats(-0.02, 0.02))
def test_whatever_lossy_cylinders_make_is_reciprocal_and_passive(
    a: float, b: float, shear_loss: float, compression_loss: float, theta: float, e: float
) -> None:
    z = effective_stiffness(Cylinder(a * (1 + 1j * shear_loss), b * (1 + 1j * compression_loss)), theta, e)
    np.testing.assert_allclose(z, z.T, atol=1e-9 * np.max(np.abs(z)))
    assert least_loss(z)[0] >= -1e-6


def test_a_joint_that_would_feed_a_coupled_motion_is_not_passive() -> None:
    z = np.array([[1e6 + 5e4j, 5e5 + 1e5j, 0], [5e5 + 1e5j, 1e6 + 5e4j, 0], [0, 0, 100]], dtype=complex)
    assert np.all(np.diag(z).imag >= 0)  # no diagonal term gives it away
    loss, motion = least_loss(z)
    assert loss < -1e-9
    assert (motion.conj() @ z @ motion).imag < 0


def test_a_joint_matrix_that_is_not_three_by_three_is_refused() -> None:
    with pytest.raises(AnalysisError, match="joint I needs a dynamic stiffness matrix of 3 by 3"):
        Joint("I", 2, np.eye(2, dtype=complex))


def test_a_single_cylinder_is_refused_where_two_are_needed() -> None:
    with pytest.raises(AnalysisError, match="a lower and an upper cylinder"):
        joint_from_cylinders("I", 2, [Cylinder(1e5, 1e6)], [0.7], 0.006)
