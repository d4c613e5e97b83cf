import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.structure.beam import Beam, FreeBeam, Mesh, assemble
from analysis.structure.converged import converged

NODES = np.array([0.0, 0.055, 0.156, 0.257, 0.358, 0.457, 0.556, 0.657, 0.758, 0.859, 0.914])


def on_elements(beam: Beam, elements_between: int) -> FreeBeam:
    mesh = Mesh.through(NODES, elements_between)
    return assemble(beam, mesh, damping_ratios=(0.004, 0.001, 0.001), point_masses={3: 0.02})


def determinant(beam: Beam, frequency: float) -> float:
    """Zero where Timoshenko's beam can bend with free ends: of the map from one end's motion to the other's load."""
    return float(np.linalg.det(across(beam, frequency)[2:, :2]))


def across(beam: Beam, frequency: float) -> np.ndarray:
    """(4, 4) from deflection, rotation, moment and shear force at the left end to those at the right one."""
    square = (2 * np.pi * frequency) ** 2
    shear_modulus = beam.youngs_modulus / (2 * (1 + beam.poisson_ratio))
    state = np.zeros((4, 4))  # deflection, rotation, moment, shear force along the beam
    state[0, 1], state[0, 3] = 1.0, 1 / (beam.shear_correction * beam.area * shear_modulus)
    state[1, 2] = 1 / beam.flexural_rigidity
    state[2, 1], state[2, 3] = -square * beam.density * beam.second_moment, -1.0
    state[3, 0] = -square * beam.density * beam.area
    return np.asarray(expm(beam.length * state))


def test_two_meshes_give_the_frequencies_of_a_continuous_beam(paper_beam: Beam) -> None:
    coarse, fine = (assemble(paper_beam, Mesh.through(NODES, elements)) for elements in (4, 8))
    found = converged(fine, coarse).frequency[3:8]
    exact = [brentq(lambda f: determinant(paper_beam, f), 0.999 * each, 1.001 * each, xtol=1e-9) for each in found]
    assert np.max(np.abs(found / exact - 1)[:3]) < 1.1e-6  # up to the 1024 Hz that are measured
    assert np.min(fine.frequency[3:8] / exact - 1) > 0
    assert np.max(np.abs(found - exact) / (fine.frequency[3:8] - exact)) < 0.1


def test_a_third_mesh_leaves_a_thirtieth_of_what_two_leave(paper_beam: Beam) -> None:
    beams = [assemble(paper_beam, Mesh.through(NODES, elements)) for elements in (8, 4, 2)]
    two, three = (converged(*of).frequency[3:6] for of in (beams[:2], beams))
    exact = [brentq(lambda f: determinant(paper_beam, f), 0.999 * each, 1.001 * each, xtol=1e-9) for each in two]
    assert np.max(np.abs(three / exact - 1)) < 3e-8
    assert np.max(np.abs(three - exact) / np.abs(two - exact)) < 1 / 30


@pytest.mark.parametrize("frequency", [20.0, 123.0, 300.0, 700.0, 1000.0])
def test_ends_move_under_a_force_as_those_of_a_continuous_beam(paper_beam: Beam, frequency: float) -> None:
    transfer = across(paper_beam, frequency)
    left = np.linalg.solve(transfer[2:, :2], [0.0, 1.0])  # under a unit force at the right end
    exact = np.array([left[0], transfer[0, :2] @ left])
    meshes = [assemble(paper_beam, Mesh.through(NODES, elements)) for elements in (8, 4, 2)]

    def ends(beam: FreeBeam) -> np.ndarray:
        degrees = np.array([beam.mesh.degree(Dof.parse(point)) for point in ("1y", "11y")])
        return np.asarray(beam.receptance(np.array(2j * np.pi * frequency), degrees, degrees[1:])[:, 0].real)

    assert np.max(np.abs(ends(converged(*meshes)) / exact - 1)) < 1e-6
    if frequency > 200:
        assert np.max(np.abs(ends(converged(*meshes)) - exact)) < 0.02 * np.max(np.abs(ends(meshes[0]) - exact))


@pytest.mark.parametrize("point", ["3y", "2y", "2x", "1x"])
def test_static_flexibility_is_whole_where_a_force_acts(paper_beam: Beam, point: str) -> None:
    """Modes that were followed to convergence with others that were not would leave a gap of 1e-4 of it."""
    beams = {elements: on_elements(paper_beam, elements) for elements in (2, 4, 8, 16, 32)}
    found, far_finer = converged(beams[8], beams[4], beams[2]), converged(beams[32], beams[16], beams[8])

    def own(beam: FreeBeam) -> complex:
        degree = np.array([beam.mesh.degree(Dof.parse(point))])
        return complex(beam.receptance(np.array(2j * np.pi * 500.0), degree, degree)[0, 0])

    assert own(found) == pytest.approx(own(far_finer), rel=1e-7)
    assert abs(own(found) / own(beams[8]) - 1) > 1e-6


def test_shapes_at_the_nodes_are_those_of_far_finer_elements(paper_beam: Beam) -> None:
    meshes = {elements: assemble(paper_beam, Mesh.through(NODES, elements)) for elements in (2, 4, 8, 16, 32)}
    far_finer, found = converged(meshes[32], meshes[16], meshes[8]), converged(meshes[8], meshes[4], meshes[2])

    def at_nodes(beam: FreeBeam) -> np.ndarray:
        shapes = beam.shapes[np.concatenate([beam.mesh.node_degrees(node) for node in range(1, 12)]), 3:8]
        return np.asarray(shapes * np.sign(shapes[1]))

    left, before = (np.abs(at_nodes(each) - at_nodes(far_finer)) for each in (found, meshes[8]))
    assert np.max(left) < 0.03 * np.max(before)


def test_matrices_and_modes_still_say_the_same(paper_beam: Beam) -> None:
    beam = converged(on_elements(paper_beam, 4), on_elements(paper_beam, 2))
    pole = 2j * np.pi * 123.0
    low = beam.shapes[:, :12]
    expected = np.diag(beam.modal_stiffness(np.array(pole))[:12])
    assert np.allclose(low.T @ beam.dynamic_stiffness(pole) @ low, expected, rtol=1e-6, atol=1.0)
    ratios = beam.damping_rate[3:6] / (2 * np.sqrt(beam.squared_frequency[3:6]))
    assert ratios == pytest.approx([0.004, 0.001, 0.001])
    assert np.all(beam.squared_frequency[:3] == 0)


def test_meshes_that_are_not_halves_of_each_other_are_refused(paper_beam: Beam) -> None:
    with pytest.raises(AnalysisError, match="every other node"):
        converged(on_elements(paper_beam, 3), on_elements(paper_beam, 2))
