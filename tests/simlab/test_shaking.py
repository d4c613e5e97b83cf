"""The simulated shaker: linear while it is faint, and in balance with the joints that it softens."""

import numpy as np
import pytest

from simlab.article import NODE_POSITIONS
from simlab.beam import Load
from simlab.case.campaign import Row
from simlab.coupling import CoupledBeam, block_diagonal
from simlab.ordinary import draw_article
from simlab.stand import Stand
from tests.simlab.shaking import shake
from tests.simlab.specimens import built_of

ARTICLE = draw_article(3)
PLACE = NODE_POSITIONS[4]
FREQUENCY = np.arange(60.0, 300.0, 4.0)


def test_faint_sines_find_the_beam_on_joints_at_rest() -> None:
    stand = Stand(built_of(ARTICLE), FREQUENCY)
    expected = stand.blow(Row(5, "y"), 0, 1e-2, Load(PLACE, y=1.0))
    found = shake(ARTICLE, PLACE, [(ARTICLE.sensor_position, "y")], FREQUENCY, 1e-4)
    np.testing.assert_allclose(found.accelerance[0], expected, rtol=1e-3)


def test_louder_sines_shift_the_peaks_down_and_broaden_them() -> None:
    fine = np.arange(70.0, 90.0, 0.1)
    faint, loud = (shake(ARTICLE, PLACE, [(PLACE, "y")], fine, force) for force in (0.01, 5.0))
    first, second = (np.abs(each.accelerance[0]) for each in (faint, loud))
    assert fine[np.argmax(second)] < fine[np.argmax(first)] - 1.0
    assert second.max() < 0.8 * first.max()
    assert loud.amplitudes["I"].max() < 500 * faint.amplitudes["I"].max()


def test_every_line_is_in_balance_with_the_joints_of_its_own_amplitude() -> None:
    found = shake(ARTICLE, PLACE, [(PLACE, "y")], FREQUENCY, 2.0)
    line = int(np.argmax(found.amplitudes["I"]))
    joint = ARTICLE.joints["I"]
    stand = Stand(built_of(ARTICLE), FREQUENCY[line : line + 1])
    omega = np.array([2 * np.pi * FREQUENCY[line]], dtype=np.complex128)
    beam = CoupledBeam(stand.modes, stand.supports, omega)
    joints = [
        each.dynamic_stiffness(float(found.amplitudes[name][line]), FREQUENCY[line])
        for name, each in ARTICLE.joints.items()
    ]
    pushed = stand.modes.shape("y", PLACE)[None]
    moved = [
        beam.accelerance(stand.modes.shape(way, joint.position), pushed, block_diagonal(joints, 1))[0, 0]
        for way in "xy"
    ]
    amplitude = 2.0 * np.linalg.norm(moved) / (2 * np.pi * FREQUENCY[line]) ** 2
    assert found.amplitudes["I"][line] == pytest.approx(amplitude, rel=1e-4)
