from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.inverse.expansion import force_solution, joint_degrees, joint_motion
from analysis.inverse.identification import PAPER_DOFS
from analysis.modes import Modes
from analysis.structure.beam import DIRECTIONS, FreeBeam, Mesh, assemble
from analysis.structure.forward import eigensolution

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

JOINTS = (2, 10)


@pytest.fixture(scope="module")
def coarse(bench: Bench) -> FreeBeam:
    """The bench on the paper's mesh, where every freedom of the matrices has a name."""
    positions = bench.free_beam.mesh.positions[list(bench.free_beam.mesh.named)]
    return assemble(bench.free_beam.beam, Mesh.through(positions, 1), damping_ratios=(0.004, 0.001, 0.001))


@pytest.fixture(scope="module")
def exact(bench: Bench, coarse: FreeBeam) -> Modes:
    everything = [Dof(node, direction) for node in range(1, 12) for direction in DIRECTIONS]
    return eigensolution(coarse, bench.joints, 1024.0, everything)


def measured_part(modes: Modes, dofs: tuple[Dof, ...] = PAPER_DOFS) -> NDArray[np.complex128]:
    return np.stack([modes.at(dof) for dof in dofs], axis=1)


def expand(
    free_beam: FreeBeam, pole: complex, shape: NDArray[np.complex128], measured: tuple[Dof, ...]
) -> NDArray[np.complex128]:
    """The whole shape of one mode from its measured components, Eq. (44)."""
    forces = force_solution(free_beam, np.array([pole]), measured, JOINTS)[0] @ shape
    everywhere = np.arange(free_beam.mesh.degrees)
    receptance = free_beam.receptance(np.array([pole]), everywhere, joint_degrees(free_beam, JOINTS))
    return np.asarray(receptance[0] @ forces)


def test_six_components_of_an_exact_mode_give_the_whole_shape(coarse: FreeBeam, exact: Modes) -> None:
    for pole, shape, six in zip(exact.poles, exact.shapes, measured_part(exact), strict=True):
        found = expand(coarse, pole, six, PAPER_DOFS)
        assert np.max(np.abs(found - shape)) < 1e-10 * np.max(np.abs(shape))


def test_any_six_components_expand_as_equation_44_has_it(coarse: FreeBeam, exact: Modes) -> None:
    rng = np.random.default_rng(5)
    at_joints = np.concatenate([coarse.mesh.node_degrees(node) for node in JOINTS])
    rows = np.setdiff1d(np.arange(coarse.mesh.degrees), at_joints)
    measured = np.array([coarse.mesh.degree(dof) for dof in PAPER_DOFS])
    unmeasured = np.setdiff1d(np.arange(coarse.mesh.degrees), measured)
    for pole in exact.poles:
        six = rng.standard_normal(6) + 1j * rng.standard_normal(6)
        z = coarse.dynamic_stiffness(pole)
        expected = np.empty(coarse.mesh.degrees, dtype=complex)
        expected[measured] = six
        expected[unmeasured] = -np.linalg.solve(z[np.ix_(rows, unmeasured)], z[np.ix_(rows, measured)] @ six)
        found = expand(coarse, pole, six, PAPER_DOFS)
        assert np.max(np.abs(found - expected)) < 1e-8 * np.max(np.abs(expected))


def test_joint_forces_are_what_the_joints_answer_to_the_motion(bench: Bench, coarse: FreeBeam, exact: Modes) -> None:
    motion = joint_motion(coarse, exact.poles, measured_part(exact), PAPER_DOFS, JOINTS)
    for place, joint in enumerate(bench.joints):
        expected = -motion.displacement[:, place] @ joint.dynamic_stiffness.T
        assert np.max(np.abs(motion.force[:, place] - expected)) < 1e-10 * np.max(np.abs(expected))


def test_more_components_than_needed_average_their_errors(bench: Bench, coarse: FreeBeam, exact: Modes) -> None:
    rng = np.random.default_rng(6)
    across = tuple(dof for dof in bench.inputs if dof.direction.value == "y")
    ends = tuple(dof for dof in bench.inputs if dof.direction.value == "x")
    shape, pole = exact.shapes[4], exact.poles[4]
    errors = {}
    for name, dofs in (("six", PAPER_DOFS), ("eleven", across + ends)):
        clean = measured_part(exact, dofs)[4]
        size = 1e-3 * np.max(np.abs(shape))
        scattered = [
            expand(coarse, pole, clean + size * rng.standard_normal(clean.size) * is_across(dofs), dofs) - shape
            for _ in range(40)
        ]
        errors[name] = np.sqrt(np.mean(np.abs(np.array(scattered)[:, 1::3]) ** 2))
    assert errors["eleven"] < 0.8 * errors["six"]


def is_across(dofs: tuple[Dof, ...]) -> NDArray[np.float64]:
    return np.array([dof.direction.value == "y" for dof in dofs], dtype=float)


def test_five_components_for_two_joints_are_refused(coarse: FreeBeam, exact: Modes) -> None:
    five = PAPER_DOFS[:5]
    with pytest.raises(
        AnalysisError, match="2 joints need 6 shape components or more, of which 1x, 1y, 3y, 9y, 11y were"
    ):
        joint_motion(coarse, exact.poles, measured_part(exact, five), five, JOINTS)


def test_components_without_one_along_the_beam_are_refused(coarse: FreeBeam, exact: Modes) -> None:
    across = tuple(Dof.parse(f"{node}y") for node in (1, 3, 5, 7, 9, 11))
    with pytest.raises(AnalysisError, match="do not determine the motion of joints at nodes"):
        joint_motion(coarse, exact.poles, measured_part(exact, across), across, JOINTS)


def test_shapes_of_another_number_of_components_are_refused(coarse: FreeBeam, exact: Modes) -> None:
    with pytest.raises(AnalysisError, match=r"expected \(modes, measured\) = \(6, 6\)"):
        joint_motion(coarse, exact.poles, exact.shapes, PAPER_DOFS, JOINTS)
