from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.dof import Direction, Dof
from analysis.structure import element
from analysis.structure.beam import Beam, Mesh, Theory, assemble
from analysis.structure.beam_motion import modes_near, modes_under_blow

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

PLACES, WEIGHTS = (lambda nodes: ((nodes[0] + 1) / 2, nodes[1] / 2))(np.polynomial.legendre.leggauss(6))


@settings(deadline=None)
@given(length=st.floats(0.005, 0.3), phi=st.floats(0.0, 20.0))
def test_shape_functions_are_those_of_the_mass_matrices(length: float, phi: float) -> None:
    transverse = np.array([element.transverse_shape(place, length, phi)[0] for place in PLACES])
    rotation = np.array([element.rotation_shape(place, length, phi)[0] for place in PLACES])
    axial = np.array([element.rod_shape(place, length)[0] for place in PLACES])
    lever = np.array([1.0, length, 1.0, length])
    for shapes, expected, scale in (
        (transverse, element.translational_mass(1.0, length, phi), lever),
        (rotation, element.rotary_mass(1.0, length, phi) * length**2, lever),
        (axial, element.rod_mass(1.0, length), np.ones(2)),
    ):
        power = length**2 if shapes is rotation else 1.0
        integral = length * (shapes.T * WEIGHTS) @ shapes * power
        np.testing.assert_allclose(integral / np.outer(scale, scale), expected / np.outer(scale, scale), atol=1e-12)


@settings(deadline=None)
@given(place=st.floats(0.05, 0.95), length=st.floats(0.005, 0.3), phi=st.floats(0.0, 20.0))
def test_slopes_are_derivatives_of_shape_functions(place: float, length: float, phi: float) -> None:
    step = 1e-3
    for shape in (element.transverse_shape, element.rotation_shape):
        ahead, behind = (shape(place + way * step, length, phi)[0] for way in (1, -1))
        further, earlier = (shape(place + 2 * way * step, length, phi)[0] for way in (1, -1))
        numerical = (8 * (ahead - behind) - (further - earlier)) / (12 * step * length)
        np.testing.assert_allclose(shape(place, length, phi)[1], numerical, rtol=1e-8, atol=1e-9 / length**2)


@pytest.mark.parametrize("name", ["1y", "3y", "3r", "2x", "11x"])
def test_at_the_node_the_motion_is_the_nodes_own(bench: Bench, name: str) -> None:
    dof = Dof.parse(name)
    value, _ = modes_near(bench.free_beam, dof, 0.0)
    np.testing.assert_allclose(value, bench.free_beam.shapes[bench.free_beam.mesh.degree(dof)], atol=1e-12)


@pytest.mark.parametrize("theory", list(Theory))
def test_beside_a_node_low_modes_move_as_on_a_mesh_with_a_node_there(paper_beam: Beam, theory: Theory) -> None:
    nodes = np.linspace(0.0, paper_beam.length, 11)
    moved = np.insert(nodes, 4, nodes[3] + 0.002)
    free, other = (assemble(paper_beam, Mesh.through(each, 8), theory) for each in (nodes, moved))
    value, _ = modes_near(free, Dof.parse("4y"), 0.002)
    expected = other.shapes[other.mesh.degree(Dof.parse("5y"))]
    elastic = slice(3, 6)  # rigid modes mix as they please
    np.testing.assert_allclose(np.abs(value[elastic]), np.abs(expected[elastic]), rtol=2e-4)


def test_a_blow_above_the_middle_of_an_end_face_bends_the_beam_too(bench: Bench) -> None:
    free, mark = bench.free_beam, Dof.parse("11x")
    at = [free.mesh.degree(Dof(11, direction)) for direction in (Direction.X, Direction.ROTATION)]
    force_and_moment = np.array([1.0, -2e-3])  # of 1 N along the beam, 2 mm above its axis
    value, slope, _ = modes_under_blow(free, mark, 2e-3)
    np.testing.assert_allclose(value, force_and_moment @ free.shapes[at], atol=1e-12)
    np.testing.assert_allclose(2e-3 * slope, value - modes_under_blow(free, mark, 0.0)[0], atol=1e-12)


def test_a_blow_across_the_beam_is_where_it_lands(bench: Bench) -> None:
    mark = Dof.parse("4y")
    np.testing.assert_array_equal(
        modes_under_blow(bench.free_beam, mark, 2e-3)[:2], modes_near(bench.free_beam, mark, 2e-3)
    )


@pytest.mark.parametrize(("mark", "beside"), [("4y", "4x"), ("11x", "11y")])
def test_a_blow_that_leans_pushes_the_other_way_too(bench: Bench, mark: str, beside: str) -> None:
    straight, _, _ = modes_under_blow(bench.free_beam, Dof.parse(mark), 1e-3)
    other, _ = modes_near(bench.free_beam, Dof.parse(beside), 1e-3 if mark == "4y" else 0.0)
    leaning, _, turn = modes_under_blow(bench.free_beam, Dof.parse(mark), 1e-3, 0.02)
    np.testing.assert_allclose(leaning, straight + 0.02 * other, atol=1e-12)
    np.testing.assert_array_equal(turn, other)
