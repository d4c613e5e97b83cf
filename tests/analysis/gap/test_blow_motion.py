"""How far joints move under a blow, and joints that follow it."""

from collections.abc import Callable

import numpy as np
import pytest

from analysis.gap.baseline import baseline_of
from analysis.gap.bench import Mounting
from analysis.gap.blow_motion import CONTACT, MOTION_DECAY, MOTION_LINES, equivalent_amplitude, half_sine
from analysis.gap.effect import Effect
from analysis.gap.effects.joint_amplitude import CubicStiffness
from analysis.gap.fit import Likelihood
from analysis.gap.free_beam_modes import beam_modes_of
from analysis.gap.measurement import Measurement
from analysis.gap.simulation import Simulation, State

POLE = np.asarray(MOTION_DECAY + 2j * np.pi * MOTION_LINES, dtype=complex)


@pytest.fixture
def state(empty: Measurement) -> Callable[..., State]:
    """The state of both rigs at the centre of the priors, with an effect of a size."""

    def at(effects: tuple[Effect, ...], own: tuple[float, ...] = ()) -> State:
        simulation = Simulation(baseline_of(empty), beam_modes_of(empty.drawing), effects)
        likelihood = Likelihood(simulation)
        scores = np.zeros(likelihood.unknowns)
        first = len(simulation.baseline.parameters)
        scores[first : first + len(own)] = own
        return likelihood._state(scores)

    return at


def test_a_half_sine_has_the_transform_of_its_samples() -> None:
    time = np.linspace(0.0, CONTACT, 20001)
    force = np.sin(np.pi * time / CONTACT)
    summed = [np.trapezoid(force * np.exp(-pole * time), time) for pole in POLE]
    assert np.allclose(half_sine(POLE), summed, rtol=1e-6)


def test_the_equivalent_amplitude_is_that_of_a_mean_square_that_forgets() -> None:
    mounting = Mounting(np.array([[np.pi / 4, -3 * np.pi / 4]]), np.zeros((1, 2)), np.zeros(1), np.zeros(1))
    own, decay, impulse = 2 * np.pi * 80.0, 25.0, 3e-3
    moved = np.zeros((1, POLE.size, 1, 2), dtype=complex)
    moved[0, :, 0, 1] = impulse / ((POLE + decay) ** 2 + own**2)
    time = np.linspace(0.0, 0.3, 300_001)
    motion = impulse / own * np.exp(-decay * time) * np.sin(own * time)
    square = 2 * MOTION_DECAY * np.trapezoid(motion**2 * np.exp(-2 * MOTION_DECAY * time), time)
    shear, compression, whole = equivalent_amplitude(moved, mounting)[0, :, 0, 0]
    assert whole == pytest.approx(np.sqrt(2 * square), rel=0.02)
    assert shear == pytest.approx(whole / np.sqrt(2))
    assert compression == pytest.approx(whole / np.sqrt(2))


def test_each_row_moves_each_joint_by_the_blows_of_its_own(state: Callable[..., State], empty: Measurement) -> None:
    (setting,) = state((CubicStiffness(),)).settings
    assert setting.motion is not None
    rows = len(empty.sets[0].inputs)
    whole = setting.motion[:, 2, :, 0]
    assert whole.shape == (2, 2 * rows)
    # four times the force moves four times as far where stiffness is constant
    assert np.allclose(whole[:, rows:], 4 * whole[:, :rows])
    near, far = whole[:, 0], whole[:, 4]  # blows on the left end, and on the right end
    assert near[0] > 1.2 * near[1]
    assert far[1] > 1.2 * far[0]


def test_joints_and_their_motion_agree(state: Callable[..., State]) -> None:
    """A stiffening joint moves less than in proportion to force; repeating once more changes nothing."""
    found = state((CubicStiffness(),), (4.0,))
    (group,), (setting,) = found.simulation.groups, found.settings
    assert setting.motion is not None
    rows = setting.motion.shape[2] // 2
    whole = setting.motion[:, 2, :, 0]
    assert np.all(whole[:, rows:] < 4 * whole[:, :rows])
    values = found.simulation.values(found.scores.tolist())
    states = 1 + found.setups[group.set_of_state]
    again = found.simulation._in_motion(values, group, states, np.zeros(2 * rows)).motion
    assert again is not None
    assert np.allclose(again, setting.motion, rtol=1e-6)
    joints = found.answers[0].bench.joints
    assert np.ptp(joints[:, 0, 0, 1, 1].real) > 0.001 * np.max(joints[:, 0, 0, 1, 1].real)
