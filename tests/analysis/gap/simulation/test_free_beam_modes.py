"""The free beam between its nodes, and how its modes follow E, density, damping and mesh."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.gap.measurement import Drawing
from analysis.gap.simulation.free_beam_modes import BeamModes, beam_modes_of, modal_stiffness
from analysis.structure.setup import RIGID_MODES

MODES = 12
"""Up to about 4 kHz: all that a hammer drives."""
POLE = 2j * np.pi * np.array([40.0, 266.0, 900.0])


@pytest.fixture(scope="module")
def modes(drawing: Drawing) -> BeamModes:
    return beam_modes_of(drawing)


def test_motion_at_the_nodes_is_that_of_the_mesh(modes: BeamModes, drawing: Drawing) -> None:
    for node, place in enumerate(drawing.node_positions, start=1):
        for direction in Direction:
            nodal = modes.free.shapes[modes.free.mesh.degree(Dof(node, direction))]
            assert np.allclose(modes.motion(direction, float(place)), nodal, rtol=0, atol=1e-9 * np.max(np.abs(nodal)))


@pytest.mark.parametrize("direction", list(Direction))
@pytest.mark.parametrize("place", [0.02, 0.1567, 0.4, 0.9])
def test_slope_is_the_derivative_of_motion(modes: BeamModes, direction: Direction, place: float) -> None:
    step = 1e-5
    difference = (modes.motion(direction, place + step) - modes.motion(direction, place - step)) / (2 * step)
    slope = modes.slope(direction, place)
    assert np.allclose(slope[:MODES], difference[:MODES], rtol=0, atol=1e-6 * np.max(np.abs(slope[:MODES])))


def test_between_nodes_a_beam_moves_as_a_finer_mesh_does(modes: BeamModes, drawing: Drawing) -> None:
    finer = beam_modes_of(drawing, 16)
    seen = slice(RIGID_MODES, RIGID_MODES + 4)  # up to 1.4 kHz
    for place in (0.013, 0.21, 0.6175):
        coarse, fine = (np.abs(each.motion(Direction.Y, place))[seen] for each in (modes, finer))
        assert np.allclose(coarse, fine, rtol=0, atol=1e-4 * np.max(fine))


def stiffness(
    modes: BeamModes, pole: Complex, modulus: float, density: float, mesh: float, loss: float, rate: Real
) -> Complex:
    return modal_stiffness(modes.modal_parts(modulus, density, mesh, rate), pole, loss)


def test_modal_stiffness_vanishes_at_the_free_poles(modes: BeamModes) -> None:
    square, rate = modes.free.squared_frequency[RIGID_MODES:MODES], modes.damping_rate[RIGID_MODES:MODES]
    pole = -rate / 2 + 1j * np.sqrt(square - rate**2 / 4)
    found = stiffness(modes, pole, 1.0, 1.0, 0.0, 0.0, modes.damping_rate)[RIGID_MODES:MODES]
    assert np.allclose(np.diag(found) / square, 0.0, atol=1e-9)


def test_damping_ratios_are_those_given_and_the_last_holds_above(modes: BeamModes, drawing: Drawing) -> None:
    ratios = modes.damping_rate[RIGID_MODES:MODES] / (2 * np.sqrt(modes.free.squared_frequency[RIGID_MODES:MODES]))
    given = drawing.damping_ratios
    assert ratios[: len(given)] == pytest.approx(given)
    assert ratios[len(given) :] == pytest.approx(given[-1])
    assert np.all(modes.damping_rate[:RIGID_MODES] < 1e-3)


@pytest.mark.parametrize("factor", [0.97, 1.03])
def test_one_factor_on_modulus_and_density_scales_all(modes: BeamModes, factor: float) -> None:
    once = stiffness(modes, POLE, 1.0, 1.0, 0.0, 0.0, modes.damping_rate)
    assert np.allclose(stiffness(modes, POLE, factor, factor, 0.0, 0.0, modes.damping_rate), factor * once, rtol=1e-12)


def test_modulus_and_density_move_frequencies_by_their_root_and_keep_damping_ratios(modes: BeamModes) -> None:
    modulus, density = 1.05, 0.98
    ratio = np.sqrt(modulus / density)
    once = stiffness(modes, POLE, 1.0, 1.0, 0.0, 0.0, modes.damping_rate)
    scaled = stiffness(modes, ratio * POLE, modulus, density, 0.0, 0.0, modes.damping_rate)
    assert np.allclose(scaled, modulus * once, rtol=1e-9)


def test_another_modulus_is_another_drawing(modes: BeamModes, drawing: Drawing) -> None:
    stiffer = beam_modes_of(
        replace(drawing, beam=replace(drawing.beam, youngs_modulus=1.03 * drawing.beam.youngs_modulus))
    )
    elastic = slice(RIGID_MODES, MODES)
    own = stiffness(stiffer, POLE, 1.0, 1.0, 0.0, 0.0, stiffer.damping_rate)[elastic]
    assert np.allclose(stiffness(modes, POLE, 1.03, 1.0, 0.0, 0.0, modes.damping_rate)[elastic], own, rtol=1e-8)


def test_structural_loss_adds_to_the_imaginary_part_alone(modes: BeamModes) -> None:
    added = stiffness(modes, POLE, 1.0, 1.0, 0.0, 0.01, modes.damping_rate) - stiffness(
        modes, POLE, 1.0, 1.0, 0.0, 0.0, modes.damping_rate
    )
    expected = 0.01 * modes.free.squared_frequency[:, None] * np.ones(POLE.size)
    assert np.max(np.abs(added.real)) < 1e-9 * np.max(expected)
    assert np.allclose(added.imag, expected, rtol=1e-6, atol=1e-6)


def test_the_error_of_a_mesh_is_one_at_the_third_mode_and_grows_with_frequency(modes: BeamModes) -> None:
    share = modes.mesh_share
    assert share[RIGID_MODES + 2] == pytest.approx(1.0)
    assert np.all(np.diff(share[RIGID_MODES:]) >= 0)
    assert np.max(share) == 100.0
    stiffened = stiffness(modes, np.zeros(1, dtype=complex), 1.0, 1.0, 2e-3, 0.0, modes.damping_rate)[
        RIGID_MODES + 2, 0
    ]
    assert stiffened.real / modes.free.squared_frequency[RIGID_MODES + 2] == pytest.approx(1.002)


def test_negative_damping_is_refused(drawing: Drawing) -> None:
    with pytest.raises(AnalysisError):
        beam_modes_of(replace(drawing, damping_ratios=(-0.01,)))
