"""How far joints move under a blow: one amplitude for each joint and axis of its cylinders.

The motion after a blow decays, and a joint has one stiffness in each record. Which amplitude counts is not known: the
peak, or a mean over some time. Here it is a mean square that forgets, with the weight exp(-2 s t); by Parseval's
theorem it needs no more than the response at s + i w. A factor with a prior of two covers other definitions.
"""

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.bench import Mounting

MOTION_DECAY = 100.0
"""1/s; the mean is over the first 5 ms, in which the joints of a beam of a metre come near their peak."""
MOTION_LINES = np.arange(5.0, 410.0, 10.0)
"""Hz. At s + i w no peak is narrower than s, and displacement falls with the square of frequency."""
FIRST_MOTION = 10e-6
"""m, from which the repetition starts."""
REPETITIONS = 4
"""An error of a third in the first guess, times the power of amplitude that stiffness follows, each time."""
CONTACT = 1.5e-3
"""s, duration of a blow that excites a beam up to a kilohertz."""


def half_sine(pole: Complex) -> Complex:
    """(lines,) Laplace transform of a half sine of unit height and duration `CONTACT`, s, at `pole` (lines,)."""
    own = np.pi / CONTACT
    return np.asarray(own * (1 + np.exp(-pole * CONTACT)) / (pole**2 + own**2))


def equivalent_amplitude(moved: Complex, mounting: Mounting) -> Real:
    """(joints, 3, states, 1) zero to peak, m, along the axes of shear and compression, and of both together.

    Args:
        moved: (states, lines, joints, 2) transform of the joints' translation at `MOTION_LINES`, m s.
        mounting: of the cylinders; both of a joint move alike.
    """
    lean = mounting.inclination[:, 0]
    shear = np.cos(lean) * moved[..., 0] + np.sin(lean) * moved[..., 1]
    compression = np.cos(lean) * moved[..., 1] - np.sin(lean) * moved[..., 0]
    step = 2 * np.pi * (MOTION_LINES[1] - MOTION_LINES[0])
    square = [4 * MOTION_DECAY / np.pi * step * np.sum(np.abs(each) ** 2, axis=1).T for each in (shear, compression)]
    return np.asarray(np.sqrt(np.stack([*square, square[0] + square[1]], axis=1))[..., None])
