from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.inverse.identification import PAPER_DOFS, identify_joints, weakest_directions
from analysis.inverse.joint_estimate import HALF, ratio_interval, square
from analysis.inverse.undetermined_terms import WeakDirection
from analysis.modes import Modes
from analysis.structure.beam import Beam, Mesh, assemble
from analysis.structure.forward import eigensolution
from analysis.structure.joints import Joint

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

BEAM = Beam(0.914, 0.0254, 0.0507874, 207e9, 0.3, 7850.0)


def positive_matrix(seed: int, kind: int) -> NDArray[np.float64]:
    """A random symmetric positive definite (3, 3) matrix of order one."""
    factor = np.random.default_rng([seed, kind]).standard_normal((3, 3))
    return factor @ factor.T + 0.3 * np.eye(3)


def random_joint(seed: int, name: str, node: int, k_bar: float, loss: float) -> Joint:
    lever = np.array([1.0, 1.0, 0.1])  # a rotation of one radian about a point 0.1 L away
    scale = k_bar * BEAM.stiffness_unit * np.outer(lever, lever)
    shape = positive_matrix(seed, 0) + 1j * loss * positive_matrix(seed, 1)
    return Joint(name, node, np.asarray(scale * shape, dtype=complex))


@st.composite
def unequal_meshes(draw: st.DrawFn) -> NDArray[np.float64]:
    gaps = np.array(draw(st.lists(st.floats(0.6, 1.6), min_size=10, max_size=10)))
    return np.concatenate([[0.0], np.cumsum(gaps) / np.sum(gaps) * BEAM.length])


@settings(max_examples=40, deadline=None)
@given(
    positions=unequal_meshes(),
    elements=st.integers(1, 4),
    nodes=st.sampled_from([(6,), (2, 10), (3, 8), (2, 6, 10)]),
    seed=st.integers(0, 2**32 - 1),
    k_bar=st.floats(20.0, 200.0),
    loss=st.floats(0.0, 0.2),
    damping=st.floats(0.0, 0.01),
)
def test_exact_modes_in_exact_joints_out(
    positions: NDArray[np.float64],
    elements: int,
    nodes: tuple[int, ...],
    seed: int,
    k_bar: float,
    loss: float,
    damping: float,
) -> None:
    positions[-1] = BEAM.length
    free_beam = assemble(BEAM, Mesh.through(positions, elements), damping_ratios=(damping, damping / 2, damping / 4))
    joints = [random_joint(seed + node, f"at {node}", node, k_bar, loss) for node in nodes]
    measured = tuple(Dof.parse(f"{node}{way}") for node in range(1, 12) if node not in nodes for way in "xy")
    modes = eigensolution(free_beam, joints, 1500.0, measured)
    found = identify_joints(
        free_beam, modes, {joint.name: joint.node for joint in joints}, measured, average_longitudinal=False
    )
    for joint in joints:
        estimate = found[joint.name]
        exact, got = (
            joint.dynamic_stiffness / BEAM.stiffness_unit,
            estimate.joint.dynamic_stiffness / BEAM.stiffness_unit,
        )
        assert np.max(np.abs(got - exact)) < 1e-9 * np.max(np.abs(exact))


def test_six_components_suffice_for_the_two_joints_of_the_bench(bench: Bench) -> None:
    found = identify_joints(bench.free_beam, bench.modes, bench.joint_nodes, average_longitudinal=False)
    unit = bench.free_beam.beam.stiffness_unit
    for joint in bench.joints:
        error = np.abs(found[joint.name].joint.dynamic_stiffness - joint.dynamic_stiffness) / unit
        assert np.max(error) < 1e-9 * np.max(np.abs(joint.dynamic_stiffness / unit))


def test_averaging_along_the_beam_costs_eight_percent_of_k12_at_joint_one(bench: Bench) -> None:
    found = identify_joints(bench.free_beam, bench.modes, bench.joint_nodes)
    unit = bench.free_beam.beam.stiffness_unit
    first, exact = found["I"], bench.joints[0].dynamic_stiffness
    assert exact[0, 1].real / unit[0, 1] == pytest.approx(103.2, abs=0.05)
    assert first.stiffness[0, 1] / unit[0, 1] == pytest.approx(94.6, abs=0.1)
    assert first.damping[0, 1] / exact[0, 1].imag == pytest.approx(0.61, abs=0.01)
    assert first.damping[0, 0] / exact[0, 0].imag == pytest.approx(1.56, abs=0.01)
    for joint in bench.joints:
        assert found[joint.name].stiffness[1, 1] == pytest.approx(joint.dynamic_stiffness[1, 1].real, rel=0.012)


def test_intervals_cover_what_averaging_does_where_the_papers_do_not(bench: Bench) -> None:
    found = identify_joints(bench.free_beam, bench.modes, bench.joint_nodes)
    outside = []
    for joint in bench.joints:
        estimate, exact = found[joint.name], joint.dynamic_stiffness
        assert np.all(estimate.k_ci95[..., 0] <= exact.real)
        assert np.all(exact.real <= estimate.k_ci95[..., 1])
        papers_half = 1.95996 * square(np.sqrt(np.diag(estimate.covariance)[:HALF]))  # normal, as for Table 2
        outside.append(np.abs(exact.real - estimate.stiffness) > papers_half)
        width = np.ptp(estimate.k_ci95, axis=-1) / (2 * papers_half)
        np.testing.assert_allclose(width, 2 * 2.0639 / 1.95996, rtol=1e-4)  # 96 against 24 degrees of freedom
    assert outside[0][0, 1]


def test_intervals_are_the_wider_of_scatter_and_propagated_uncertainty(bench: Bench) -> None:
    chosen = np.stack([bench.modes.at(dof) for dof in PAPER_DOFS], axis=1)
    size = np.max(np.abs(chosen), axis=1)
    modes = Modes(
        bench.modes.poles,
        chosen,
        PAPER_DOFS,
        pole_covariance=np.diag(np.tile([0.02, 1e-3], 6) ** 2),
        shape_covariance=(1e-3 * size[:, None, None]) ** 2 * np.eye(12),
    )
    found = identify_joints(bench.free_beam, modes, bench.joint_nodes, average_longitudinal=False)["I"]
    assert found.propagated_covariance is not None
    half = 1.959964 * np.sqrt(found.propagated_covariance[3, 3])  # the scatter of exact modes is zero
    np.testing.assert_allclose(found.k_ci95[1, 1], found.stiffness[1, 1] + half * np.array([-1, 1]), rtol=1e-6)
    low, high = found.loss_factor_ci95[1, 1]
    assert low < found.loss_factor[1, 1] < high


def test_a_loss_factor_needs_a_stiffness_that_is_not_zero(bench: Bench) -> None:
    found = identify_joints(bench.free_beam, bench.modes, bench.joint_nodes)["I"]
    includes_zero = (found.k_ci95[..., 0] < 0) & (found.k_ci95[..., 1] > 0)
    assert includes_zero[0, 2]
    assert includes_zero[2, 2]
    assert np.array_equal(np.isnan(found.loss_factor), includes_zero)
    assert np.array_equal(np.isnan(found.loss_factor_ci95[..., 0]), includes_zero)


def test_only_the_sum_of_the_axial_stiffnesses_counts_as_observable(bench: Bench) -> None:
    for average in (True, False):
        found = identify_joints(bench.free_beam, bench.modes, bench.joint_nodes, average_longitudinal=average)
        for estimate in found.values():
            expected = [[False, True, False], [True, True, False], [False, False, False]]
            np.testing.assert_array_equal(estimate.observable, expected)
    weak = weakest_directions(bench.free_beam, bench.modes, found)
    assert weak is not None
    weakest = [direction for direction in weak[:2] if isinstance(direction, WeakDirection)]
    assert {direction.terms for direction in weakest} == {
        (("k11(I)", 1.0), ("k11(II)", -1.0)),
        (("h11(I)", 1.0), ("h11(II)", -1.0)),
    }
    stiffness = next(direction for direction in weakest if direction.terms[0][0] == "k11(I)")
    assert stiffness.standard_deviation == pytest.approx(460, abs=5)
    assert stiffness.reversed_deviation == pytest.approx(1.5, abs=0.5)


def test_far_better_modes_do_not_make_the_axial_stiffnesses_observable(bench: Bench) -> None:
    size = np.max(np.abs(bench.modes.shapes), axis=1)
    modes = replace(
        bench.modes,
        pole_covariance=np.diag(np.tile([1e-4, 1e-5], 6) ** 2),
        shape_covariance=(1e-5 * size[:, None, None]) ** 2 * np.eye(22),
    )
    found = identify_joints(bench.free_beam, modes, bench.joint_nodes)["I"]
    assert list(found.observable[0]) == [False, True, False]
    assert found.observable[1, 1]


def test_far_worse_modes_leave_nothing_observable(bench: Bench) -> None:
    size = np.max(np.abs(bench.modes.shapes), axis=1)
    modes = replace(
        bench.modes,
        pole_covariance=np.diag(np.tile([20.0, 0.1], 6) ** 2),
        shape_covariance=(0.5 * size[:, None, None]) ** 2 * np.eye(22),
    )
    assert not np.any(identify_joints(bench.free_beam, modes, bench.joint_nodes)["I"].observable)


def test_a_heavy_cap_is_known_to_the_beam_and_stays_out_of_the_joint(bench: Bench) -> None:
    mesh, beam = bench.free_beam.mesh, bench.free_beam.beam
    laden = assemble(beam, mesh, point_masses={2: 0.2, 10: 0.2})
    modes = eigensolution(laden, bench.joints, 1024.0, PAPER_DOFS)
    aware = identify_joints(laden, modes, bench.joint_nodes, average_longitudinal=False)["I"]
    unaware = identify_joints(assemble(beam, mesh), modes, bench.joint_nodes, average_longitudinal=False)["I"]
    exact = bench.joints[0].dynamic_stiffness[1, 1].real
    assert aware.stiffness[1, 1] == pytest.approx(exact, rel=1e-9)
    assert unaware.stiffness[1, 1] < 0.97 * exact


def test_figure_5_holds_an_observed_and_a_fitted_value_for_every_equation(bench: Bench) -> None:
    regression = identify_joints(bench.free_beam, bench.modes, bench.joint_nodes)["I"].regression
    assert regression.observed.shape == regression.fitted.shape == (108,)
    assert np.corrcoef(regression.observed, regression.fitted)[0, 1] ** 2 > 0.95


def test_two_modes_are_refused_with_the_rank_they_reach(bench: Bench) -> None:
    two = Modes(bench.modes.poles[:2], bench.modes.shapes[:2], bench.modes.dofs)
    with pytest.raises(AnalysisError, match="2 modes determine 10 of the 12 terms"):
        identify_joints(bench.free_beam, two, bench.joint_nodes)


def test_a_missing_component_is_named(bench: Bench) -> None:
    without = Modes(bench.modes.poles, bench.modes.shapes[:, :-1], bench.modes.dofs[:-1])
    with pytest.raises(AnalysisError, match="no component 11x"):
        identify_joints(bench.free_beam, without, bench.joint_nodes)


def test_two_joints_at_one_node_are_refused(bench: Bench) -> None:
    with pytest.raises(AnalysisError, match="a node each of their own"):
        identify_joints(bench.free_beam, bench.modes, {"I": 2, "II": 2})


def test_fiellers_interval_holds_the_ratio_as_often_as_promised() -> None:
    rng = np.random.default_rng(1)
    covariance = np.array([[0.04, 0.01], [0.01, 0.09]])
    draws = rng.multivariate_normal([0.5, 2.0], covariance, size=4000)
    intervals = [ratio_interval(n, d, covariance, 1.96) for n, d in draws]
    held = [interval is None or interval[0] <= 0.25 <= interval[1] for interval in intervals]
    assert np.mean(held) == pytest.approx(0.95, abs=0.012)


def test_a_denominator_like_zero_has_no_ratio() -> None:
    assert ratio_interval(1.0, 0.1, np.diag([0.01, 0.01]), 1.96) is None
