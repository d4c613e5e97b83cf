from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.structure.beam import Beam, Mesh, Theory, assemble


def ten_equal_elements(beam: Beam, elements_between: int = 1) -> Mesh:
    return Mesh.through(np.linspace(0, beam.length, 11), elements_between)


@pytest.mark.parametrize(
    ("theory", "expected"),
    [(Theory.TIMOSHENKO, [160.06, 439.13, 855.68]), (Theory.EULER_BERNOULLI, [160.5, 442.5, 868.1])],
)
def test_ten_equal_elements_give_the_free_frequencies_of_table_1(
    paper_beam: Beam, theory: Theory, expected: list[float]
) -> None:
    free_beam = assemble(paper_beam, ten_equal_elements(paper_beam), theory)
    np.testing.assert_allclose(free_beam.frequency[3:6], expected, atol=0.1)


def test_euler_bernoulli_converges_to_the_closed_form(paper_beam: Beam) -> None:
    roots = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671])
    wave_speed = np.sqrt(paper_beam.flexural_rigidity / (paper_beam.density * paper_beam.area))
    expected = roots**2 / (2 * np.pi) * wave_speed / paper_beam.length**2
    found = assemble(paper_beam, ten_equal_elements(paper_beam, 4), Theory.EULER_BERNOULLI).frequency[3:6]
    np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_ten_elements_put_the_third_free_mode_a_fifth_of_a_percent_high(paper_beam: Beam) -> None:
    coarse, default, fine = (
        assemble(paper_beam, ten_equal_elements(paper_beam, elements)).frequency[5] for elements in (1, 4, 16)
    )
    assert coarse / fine - 1 == pytest.approx(0.0019, abs=1e-4)
    assert 0 < default / fine - 1 < 1e-4


def test_rigid_motion_costs_no_force_and_carries_the_mass_of_the_bar(paper_beam: Beam) -> None:
    free_beam = assemble(paper_beam, ten_equal_elements(paper_beam))
    x = free_beam.mesh.positions
    along, across, turn = (np.zeros(free_beam.mesh.degrees) for _ in range(3))
    along[0::3], across[1::3], turn[1::3], turn[2::3] = 1.0, 1.0, x - x.mean(), 1.0
    for motion in (along, across, turn):
        assert np.max(np.abs(free_beam.stiffness @ motion)) < 1e-9 * np.max(free_beam.stiffness)
    kilograms = paper_beam.density * paper_beam.area * paper_beam.length
    assert along @ free_beam.mass @ along == pytest.approx(kilograms)
    assert across @ free_beam.mass @ across == pytest.approx(kilograms)
    inertia = kilograms * (paper_beam.length**2 + paper_beam.height**2) / 12
    assert turn @ free_beam.mass @ turn == pytest.approx(inertia)


def test_a_cantilever_bends_and_shears_as_timoshenko_says(paper_beam: Beam) -> None:
    free_beam = assemble(paper_beam, ten_equal_elements(paper_beam))
    load = np.zeros(free_beam.mesh.degrees - 3)
    load[-2] = 1.0
    tip = np.linalg.solve(free_beam.stiffness[3:, 3:], load)[-2]
    shear_modulus = paper_beam.youngs_modulus / (2 * (1 + paper_beam.poisson_ratio))
    bending = paper_beam.length**3 / (3 * paper_beam.flexural_rigidity)
    shear = paper_beam.length / (paper_beam.shear_correction * shear_modulus * paper_beam.area)
    assert tip == pytest.approx(bending + shear, rel=1e-8)
    assert shear / bending > 1e-4  # or the test would not see shear


def test_free_modes_are_orthonormal_in_mass_and_diagonal_in_stiffness_and_damping(paper_beam: Beam) -> None:
    free_beam = assemble(paper_beam, ten_equal_elements(paper_beam), damping_ratios=(0.004, 0.001))
    shapes, squared = free_beam.shapes, free_beam.squared_frequency
    np.testing.assert_allclose(shapes.T @ free_beam.mass @ shapes, np.eye(len(squared)), atol=1e-8)
    np.testing.assert_allclose((shapes.T @ free_beam.stiffness @ shapes)[:9, :9], np.diag(squared[:9]), atol=1e-4)
    damped = 2 * np.array([0.004, 0.001]) * 2 * np.pi * free_beam.frequency[3:5]
    np.testing.assert_allclose(np.diag(shapes.T @ free_beam.damping @ shapes)[3:5], damped, rtol=1e-9)
    assert np.max(np.abs((free_beam.damping @ shapes)[:, :3])) < 1e-9 * np.max(free_beam.damping)


def test_the_last_damping_ratio_holds_for_all_modes_above(paper_beam: Beam) -> None:
    free_beam = assemble(paper_beam, ten_equal_elements(paper_beam), damping_ratios=(0.004, 0.001))
    expected = np.where(np.arange(30) == 0, 0.004, 0.001)
    found = free_beam.damping_rate[3:] / (2 * np.sqrt(free_beam.squared_frequency[3:]))
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert not np.any(assemble(paper_beam, ten_equal_elements(paper_beam)).damping)


def test_receptance_is_the_inverse_of_the_dynamic_stiffness(paper_beam: Beam) -> None:
    free_beam = assemble(paper_beam, ten_equal_elements(paper_beam), damping_ratios=(0.004,))
    pole = complex(-20.0, 1500.0)
    rows, columns = np.array([0, 1, 7]), np.array([4, 30])
    direct = np.linalg.inv(free_beam.dynamic_stiffness(pole))[np.ix_(rows, columns)]
    found = free_beam.receptance(np.array([pole]), rows, columns)[0]
    assert np.max(np.abs(found - direct)) < 1e-10 * np.max(np.abs(direct))

    step = 1e-3
    up, down = (free_beam.receptance(np.array([pole + s]), rows, columns)[0] for s in (step, -step))
    slope = free_beam.receptance_slope(np.array([pole]), rows, columns)[0]
    assert np.max(np.abs((up - down) / (2 * step) - slope)) < 1e-6 * np.max(np.abs(slope))


def test_a_point_mass_weighs_in_x_and_y_at_its_node_alone(paper_beam: Beam) -> None:
    mesh = ten_equal_elements(paper_beam, 2)
    added = assemble(paper_beam, mesh, point_masses={3: 0.02}).mass - assemble(paper_beam, mesh).mass
    places = [mesh.degree(Dof.parse("3x")), mesh.degree(Dof.parse("3y"))]
    expected = np.zeros_like(added)
    expected[places, places] = 0.02
    np.testing.assert_allclose(added, expected, atol=1e-15)


@given(gaps=st.lists(st.floats(0.01, 0.2), min_size=2, max_size=8), elements=st.integers(1, 5))
def test_named_nodes_lie_where_they_were_asked_for(gaps: list[float], elements: int) -> None:
    positions = np.concatenate([[0.0], np.cumsum(gaps)])
    mesh = Mesh.through(positions, elements)
    np.testing.assert_allclose(mesh.positions[list(mesh.named)], positions, rtol=1e-14)
    assert mesh.positions.size == elements * len(gaps) + 1
    assert mesh.degree(Dof.parse("2r")) == 3 * elements + 2
    within = np.diff(mesh.positions).reshape(len(gaps), elements)
    np.testing.assert_allclose(within, np.array(gaps)[:, None] / elements + np.zeros_like(within), rtol=1e-9)


@pytest.mark.parametrize("positions", [[0.0], [0.0, 0.3, 0.3], [0.0, 0.5, 0.4], [0.0, float("nan")]])
def test_node_positions_that_do_not_rise_are_refused(positions: list[float]) -> None:
    with pytest.raises(AnalysisError, match="rising"):
        Mesh.through(positions)


def test_a_mesh_of_another_length_than_the_beam_is_refused_with_both_lengths(paper_beam: Beam) -> None:
    with pytest.raises(AnalysisError, match=r"0\.9 m, the beam from 0 to 0\.914 m"):
        assemble(paper_beam, Mesh.through([0.0, 0.4, 0.9]))


def test_an_unknown_node_is_refused_with_the_nodes_there_are(paper_beam: Beam) -> None:
    with pytest.raises(AnalysisError, match="no node 12; the beam has nodes 1 to 11"):
        ten_equal_elements(paper_beam).degree(Dof.parse("12y"))


@pytest.mark.parametrize("ratios", [(-0.01,), (1.5,), (float("nan"),)])
def test_impossible_damping_ratios_are_refused(paper_beam: Beam, ratios: tuple[float, ...]) -> None:
    with pytest.raises(AnalysisError, match="damping ratios"):
        assemble(paper_beam, ten_equal_elements(paper_beam), damping_ratios=ratios)


def test_a_negative_point_mass_is_refused(paper_beam: Beam) -> None:
    with pytest.raises(AnalysisError, match="node 3 is -1 kg"):
        assemble(paper_beam, ten_equal_elements(paper_beam), point_masses={3: -1})


def test_a_beam_without_density_is_refused() -> None:
    with pytest.raises(AnalysisError, match="density is 0"):
        Beam(0.914, 0.0254, 0.0508, 207e9, 0.3, 0.0)


def test_a_poisson_ratio_above_a_half_is_refused() -> None:
    with pytest.raises(AnalysisError, match=r"poisson_ratio is 0\.6"):
        Beam(0.914, 0.0254, 0.0508, 207e9, 0.6, 7850.0)


def test_another_material_scales_the_free_beam_exactly(paper_beam: Beam) -> None:
    mesh, ratios = Mesh.through([0.0, 0.3, paper_beam.length]), (0.004, 0.001)
    other = replace(paper_beam, youngs_modulus=1.02 * paper_beam.youngs_modulus, density=0.97 * paper_beam.density)
    expected, found = assemble(other, mesh, damping_ratios=ratios), assemble(paper_beam, mesh, damping_ratios=ratios)
    found = found.with_material(1.02, 0.97)
    assert found.beam == other
    pole = 2000j - 3.0
    np.testing.assert_allclose(found.dynamic_stiffness(pole), expected.dynamic_stiffness(pole), rtol=1e-8, atol=1e-3)
    rows = np.arange(mesh.degrees)
    receptance = expected.receptance(np.array([pole]), rows, rows)
    np.testing.assert_allclose(found.receptance(np.array([pole]), rows, rows), receptance, rtol=1e-6, atol=1e-16)
