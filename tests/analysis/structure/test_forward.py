from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.structure.beam import DIRECTIONS, Beam, FreeBeam, Mesh, assemble
from analysis.structure.forward import accelerance, eigensolution
from analysis.structure.joints import Joint

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

Matrix = NDArray[np.complex128]
RESPONSE = Dof.parse("3y")


def assembled(free_beam: FreeBeam, joints: tuple[Joint, ...], pole: complex) -> Matrix:
    """(N, N) the whole dynamic stiffness Z + z, Eqs. (39)-(41)."""
    whole = free_beam.dynamic_stiffness(pole)
    for joint in joints:
        at = free_beam.mesh.node_degrees(joint.node)
        whole[np.ix_(at, at)] += joint.dynamic_stiffness
    return whole


def refined_solution(matrix: Matrix, right: Matrix) -> Matrix:
    """Solution with two steps of refinement in extended precision, so that the reference is good to 1e-12."""
    factors = scipy.linalg.lu_factor(matrix)
    solution = scipy.linalg.lu_solve(factors, right)
    for _ in range(2):
        left_over = right - matrix.astype(np.clongdouble) @ solution.astype(np.clongdouble)
        solution = solution + scipy.linalg.lu_solve(factors, left_over.astype(complex))
    return np.asarray(solution)


def directly_inverted(
    free_beam: FreeBeam, joints: tuple[Joint, ...], frequency: float, response: Dof, inputs: tuple[Dof, ...]
) -> Matrix:
    angular = 2 * np.pi * frequency
    unit = np.zeros((free_beam.mesh.degrees, len(inputs)), dtype=complex)
    unit[[free_beam.mesh.degree(dof) for dof in inputs], np.arange(len(inputs))] = 1.0
    displacement = refined_solution(assembled(free_beam, joints, 1j * angular), unit)
    return np.asarray(-(angular**2) * displacement[free_beam.mesh.degree(response)])


def test_the_bench_has_the_modes_computed_for_it_independently(bench: Bench) -> None:
    np.testing.assert_allclose(bench.modes.frequency, [76.9, 79.3, 204, 262, 464, 859], rtol=1.5e-3)


def test_the_bench_is_within_two_percent_of_the_published_experiment(bench: Bench) -> None:
    np.testing.assert_allclose(bench.modes.frequency, [77.4, 79.5, 204, 266, 469, 865], rtol=0.02)


def test_poles_agree_with_the_whole_state_matrix(bench: Bench) -> None:
    free_beam = bench.free_beam
    inverse_mass = scipy.linalg.inv(free_beam.mass)
    stiffness = assembled(free_beam, bench.joints, 0.0)
    size = free_beam.mesh.degrees
    state = np.block(
        [[np.zeros((size, size)), np.eye(size)], [-inverse_mass @ stiffness, -inverse_mass @ free_beam.damping]]
    )
    poles = scipy.linalg.eigvals(state)
    expected = poles[(poles.imag > 0) & (poles.imag < 2 * np.pi * 1024)]
    np.testing.assert_allclose(bench.modes.poles, expected[np.argsort(expected.imag)], rtol=1e-7)


def test_shapes_solve_the_whole_problem_and_have_unit_modal_mass(bench: Bench) -> None:
    mesh = Mesh.through(bench.free_beam.mesh.positions, elements_between=1)
    free_beam = assemble(bench.free_beam.beam, mesh, damping_ratios=(0.004, 0.001, 0.001))
    joints = tuple(Joint(j.name, bench.free_beam.mesh.named[j.node - 1] + 1, j.dynamic_stiffness) for j in bench.joints)
    everything = [Dof(node + 1, direction) for node in range(mesh.positions.size) for direction in DIRECTIONS]
    modes = eigensolution(free_beam, joints, 1024.0, everything)
    for pole, shape in zip(modes.poles, modes.shapes, strict=True):
        whole = assembled(free_beam, joints, pole)
        assert np.max(np.abs(whole @ shape)) < 1e-9 * np.max(np.abs(whole) @ np.abs(shape))
        modal_mass = shape @ (2 * pole * free_beam.mass + free_beam.damping) @ shape / (2 * pole)
        assert modal_mass == pytest.approx(1.0, abs=1e-9)


def test_a_beam_without_joints_keeps_its_elastic_modes_and_damping(paper_beam: Beam) -> None:
    free_beam = assemble(paper_beam, Mesh.through([0.0, 0.4, 0.914]), damping_ratios=(0.004, 0.001))
    modes = eigensolution(free_beam, (), 600.0)
    np.testing.assert_allclose(np.abs(modes.poles), 2 * np.pi * free_beam.frequency[3:5], rtol=1e-10)
    np.testing.assert_allclose(-modes.poles.real / np.abs(modes.poles), [0.004, 0.001], rtol=1e-9)


def test_a_loss_factor_of_all_stiffness_is_the_loss_factor_of_the_rigid_modes(paper_beam: Beam) -> None:
    free_beam = assemble(paper_beam, Mesh.through([0.0, 0.4, 0.914]))
    soft = np.diag([1.0, 1.0, 1e-3]) * (1 + 0.2j)
    modes = eigensolution(free_beam, [Joint("I", 1, soft), Joint("II", 3, soft)], 2.0)
    assert modes.poles.size == 3
    np.testing.assert_allclose(modes.loss_factor, 0.2, rtol=1e-5)
    kilograms = paper_beam.density * paper_beam.area * paper_beam.length
    assert modes.frequency[0] == pytest.approx(np.sqrt(2.0 / kilograms) / (2 * np.pi), rel=1e-3)


def test_eleven_accelerances_equal_direct_inversion_to_ten_digits(bench: Bench) -> None:
    frequency = np.array([0.5, 20.0, 76.9, 79.4, 160.0, 262.0, 464.0, 859.0, 1023.5])
    found = accelerance(bench.free_beam, bench.joints, frequency, RESPONSE, bench.inputs)
    for line, hertz in enumerate(frequency):
        direct = directly_inverted(bench.free_beam, bench.joints, hertz, RESPONSE, bench.inputs)
        np.testing.assert_allclose(found.accelerance[:, line], direct, rtol=1e-10, atol=1e-10 * np.max(np.abs(direct)))


def test_joints_that_are_not_symmetric_are_inverted_the_right_way_round(bench: Bench) -> None:
    first, second = bench.joints
    lopsided = first.dynamic_stiffness.copy()
    lopsided[0, 1] *= 1.5
    joints = (Joint("I", 2, lopsided), second)
    found = accelerance(bench.free_beam, joints, np.array([80.0]), RESPONSE, bench.inputs).accelerance[:, 0]
    np.testing.assert_allclose(
        found, directly_inverted(bench.free_beam, joints, 80.0, RESPONSE, bench.inputs), rtol=1e-9
    )


def test_exchanging_blow_and_accelerometer_changes_nothing(bench: Bench) -> None:
    frequency = np.linspace(10.0, 1000.0, 50)
    one_way = accelerance(bench.free_beam, bench.joints, frequency, RESPONSE, [Dof.parse("11x")])
    other_way = accelerance(bench.free_beam, bench.joints, frequency, Dof.parse("11x"), [RESPONSE])
    np.testing.assert_allclose(one_way.accelerance, other_way.accelerance, rtol=1e-8)


def test_a_held_beam_does_not_accelerate_at_0_hz_and_a_free_one_is_refused_there(bench: Bench) -> None:
    still = accelerance(bench.free_beam, bench.joints, np.array([0.0]), RESPONSE, bench.inputs)
    assert np.all(still.accelerance == 0)
    with pytest.raises(AnalysisError, match="leave out 0 Hz"):
        accelerance(bench.free_beam, (), np.array([0.0]), RESPONSE, bench.inputs)


def test_a_free_beam_moves_as_a_rigid_body_far_below_its_modes(paper_beam: Beam) -> None:
    free_beam = assemble(paper_beam, Mesh.through([0.0, 0.457, 0.914]))
    found = accelerance(free_beam, (), np.array([0.1]), Dof.parse("2x"), [Dof.parse("2x"), Dof.parse("2y")])
    kilograms = paper_beam.density * paper_beam.area * paper_beam.length
    np.testing.assert_allclose(found.accelerance[:, 0], [1 / kilograms, 0.0], rtol=1e-5, atol=1e-9)


def test_two_joints_at_one_node_are_refused(bench: Bench) -> None:
    with pytest.raises(AnalysisError, match=r"nodes \[2, 2\]"):
        eigensolution(bench.free_beam, (bench.joints[0], bench.joints[0]), 1024.0)


def test_a_negative_frequency_is_refused(bench: Bench) -> None:
    with pytest.raises(AnalysisError, match="not negative"):
        accelerance(bench.free_beam, bench.joints, np.array([-1.0]), RESPONSE, bench.inputs)
