"""The coupled beam: the same as the whole modal problem where that can say, and reciprocal where it cannot."""

import numpy as np
import pytest

from simlab.article import INCLINATIONS_DEG, SimulatedJoint
from simlab.beam import SimulatedBeam, free_modes
from simlab.coupling import Attachment, CoupledBeam, block_diagonal
from simlab.elastomer import LinearCylinder

FREQUENCY = np.array([1.0, 76.0, 200.0, 455.5, 860.0, 1024.0])
OMEGA = (2 * np.pi * FREQUENCY).astype(np.complex128)
MODES = free_modes(SimulatedBeam())
CYLINDER = LinearCylinder(0.36e6 * (1 + 0.1j), 2.3e6 * (1 + 0.08j), 18.0 * (1 + 0.08j))


def joint(name: str, lean_deg: float = 1.5, shift: float = 0.002) -> SimulatedJoint:
    return SimulatedJoint(0.056, (CYLINDER, CYLINDER), INCLINATIONS_DEG[name], lean_deg, shift)


def matrix(name: str, lean_deg: float = 1.5, shift: float = 0.002) -> np.ndarray:
    found: np.ndarray = joint(name, lean_deg, shift).dynamic_stiffness(1e-6, 100.0)[0]
    return found


def joints_at(*places: float) -> Attachment:
    shapes = np.array([MODES.shape(d, place) for place in places for d in "xyr"])
    return Attachment(shapes, block_diagonal([matrix("I"), matrix("II")], 1)[0])


def accelerance(output: np.ndarray, load: np.ndarray, *attachments: Attachment) -> np.ndarray:
    beam = CoupledBeam(MODES, np.concatenate([each.shapes for each in attachments]), OMEGA)
    held = block_diagonal([each.stiffness for each in attachments], OMEGA.size)
    found: np.ndarray = beam.accelerance(output, load[None], held)[0]
    return found


def test_joints_give_the_accelerance_of_the_whole_modal_problem() -> None:
    joints = joints_at(0.056, 0.858)
    output, load = MODES.shape("y", 0.156), MODES.shape("x", 0.0) + 0.3 * MODES.shape("y", 0.7)
    natural, damping = MODES.angular_frequency, MODES.damping_ratio
    held = joints.shapes.T @ joints.stiffness @ joints.shapes
    impedances = [np.diag(natural**2 + 2j * damping * natural * w - w**2) + held for w in OMEGA]
    expected = [-(w**2) * output @ np.linalg.solve(z, load) for w, z in zip(OMEGA, impedances, strict=True)]
    # the beam's modes above 16 kHz act by their static compliance alone
    np.testing.assert_allclose(accelerance(output, load, joints), expected, rtol=1e-2)


def test_a_mass_hung_on_the_free_beam_gives_the_receptance_of_both_in_series() -> None:
    place, mass = MODES.shape("y", 0.3), 0.25
    free = accelerance(place, place, Attachment(place[None], np.zeros((1, 1), dtype=np.complex128)))
    loaded = accelerance(place, place, Attachment(place[None], (-mass * OMEGA**2)[:, None, None]))
    np.testing.assert_allclose(loaded, free / (1 + mass * free), rtol=1e-9)


def test_a_coupled_beam_is_reciprocal() -> None:
    spring = Attachment(MODES.shape("y", 0.4)[None], np.full((1, 1), 1e5 + 2e4j))
    one, other = MODES.shape("y", 0.156), MODES.shape("x", 0.914)
    there, back = (accelerance(*pair, joints_at(0.056, 0.858), spring) for pair in ((one, other), (other, one)))
    np.testing.assert_allclose(there, back, rtol=1e-9)


def test_a_line_at_zero_hertz_is_refused() -> None:
    with pytest.raises(ValueError, match="above 0 Hz"):
        CoupledBeam(MODES, MODES.shape("y", 0.4)[None], np.array([0.0, 1.0], dtype=np.complex128))


def test_slopes_are_those_of_the_shapes() -> None:
    step = 1e-5
    difference = (MODES.shape("y", 0.4 + step) - MODES.shape("y", 0.4 - step)) / (2 * step)
    low = MODES.frequency < 5000.0
    np.testing.assert_allclose(MODES.slope("y", 0.4)[low], difference[low], rtol=1e-5, atol=1e-5)


def test_leaning_towards_the_vertical_stiffens_a_joint_across_the_beam() -> None:
    first, second = (matrix(name, 0.0, 0.0).real for name in ("I", "II"))
    assert matrix("II").real[1, 1] > second[1, 1]
    assert second[0, 1] < 0 < first[0, 1]
    np.testing.assert_allclose(second[1, 1], 0.36e6 + 2.3e6, rtol=1e-12)
