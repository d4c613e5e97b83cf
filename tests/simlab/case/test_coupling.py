"""The coupled bar: the same as the bench's own assembly where both can say, and reciprocal where neither can."""

from __future__ import annotations

import numpy as np

from simlab.assembly import Assembly
from simlab.beam import Bar, free_modes
from simlab.case.article import Article, Joint, joint_matrix
from simlab.case.coupling import Attachment, CoupledBar

FREQUENCY = np.array([1.0, 76.0, 200.0, 455.5, 860.0, 1024.0])
OMEGA = (2 * np.pi * FREQUENCY).astype(np.complex128)
BAR = Bar()
MODES = free_modes(BAR)
ARTICLE = Article(BAR, {}, 0.156)
JOINT = Joint(0.056, 0.36e6 * (1 + 0.1j), 2.3e6 * (1 + 0.08j), 18.0 * (1 + 0.08j), lean_deg=1.5, shift=0.002)


def joints_at(*places: float) -> Attachment:
    shapes = np.array([MODES.shape(d, place) for place in places for d in "xyr"])
    matrix = np.zeros((6, 6), dtype=np.complex128)
    for i, name in enumerate(("I", "II")):
        matrix[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = joint_matrix(name, JOINT, JOINT.cylinder[None])[0]
    return Attachment(shapes, matrix)


def test_joints_give_the_accelerance_of_the_bench_own_assembly() -> None:
    joints = joints_at(0.056, 0.858)
    output, load = MODES.shape("y", 0.156), MODES.shape("x", 0.0) + 0.3 * MODES.shape("y", 0.7)
    ours = CoupledBar(MODES, ARTICLE, OMEGA).accelerance(output, load[None], [joints])[0]
    assembly = Assembly(MODES, joints.shapes)
    stiffness = np.broadcast_to(joints.stiffness, (FREQUENCY.size, 6, 6))
    theirs = assembly.accelerance(assembly.lines(FREQUENCY), stiffness, output, load)
    np.testing.assert_allclose(ours, theirs, rtol=2e-5)


def test_a_mass_hung_on_the_free_bar_gives_the_receptance_of_both_in_series() -> None:
    place, mass = MODES.shape("y", 0.3), 0.25
    bar = CoupledBar(MODES, ARTICLE, OMEGA)
    nothing = Attachment(place[None], np.zeros((1, 1), dtype=np.complex128))
    free = bar.accelerance(place, place[None], [nothing])[0]
    held = Attachment(place[None], (-mass * OMEGA**2)[:, None, None])
    loaded = bar.accelerance(place, place[None], [held])[0]
    np.testing.assert_allclose(loaded, free / (1 + mass * free), rtol=1e-9)


def test_a_coupled_bar_is_reciprocal() -> None:
    bar = CoupledBar(MODES, ARTICLE, OMEGA)
    attachments = [
        joints_at(0.056, 0.858),
        Attachment(MODES.shape("y", 0.4)[None], np.full((1, 1), 1e5 + 2e4j)),
    ]
    one, other = MODES.shape("y", 0.156), MODES.shape("x", 0.914)
    there = bar.accelerance(one, other[None], attachments)
    back = bar.accelerance(other, one[None], attachments)
    np.testing.assert_allclose(there, back, rtol=1e-9)


def test_slopes_are_those_of_the_shapes() -> None:
    step = 1e-5
    difference = (MODES.shape("y", 0.4 + step) - MODES.shape("y", 0.4 - step)) / (2 * step)
    low = MODES.frequency < 5000.0
    np.testing.assert_allclose(MODES.slope("y", 0.4)[low], difference[low], rtol=1e-5, atol=1e-5)


def test_leaning_towards_the_vertical_stiffens_a_joint_across_the_bar() -> None:
    upright = joint_matrix("II", JOINT, JOINT.cylinder[None])[0].real
    drawn = Joint(JOINT.position, JOINT.shear, JOINT.compression, JOINT.rotation)
    as_drawn = joint_matrix("II", drawn, drawn.cylinder[None])[0].real
    assert upright[1, 1] > as_drawn[1, 1]
    assert as_drawn[0, 1] < 0 < joint_matrix("I", drawn, drawn.cylinder[None])[0, 0, 1].real
    np.testing.assert_allclose(as_drawn[1, 1], 0.36e6 + 2.3e6, rtol=1e-12)
