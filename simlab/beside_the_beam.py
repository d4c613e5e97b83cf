"""Hammer and accelerometer beside the beam: on a hand-held calibrator, or on a mass that is struck each second.

The measuring chain is the same as on the beam, so that what is wrong with it shows here too.
"""

from collections.abc import Callable

import numpy as np

from simlab.beam import Real
from simlab.coupling import Complex

TONE, TONE_RMS = 159.15, 10.0  # Hz and m/s^2 of the calibrator
SUSPENDED_MASS = 3.0
"""kg of the hanging mass with the accelerometer; somebody strikes it by 100 N each second, 3 ms long."""
PERIOD = 1 << 17  # points of a second, from one blow to the next
PLACES = np.linspace(0.0, 1.0, PERIOD + 1)
"""Times in s, 0 to 1, where the chain's output for a blow is tabulated; interpolation errs by 1e-5 of its peak."""
LEAST = 1e-6
"""Hz in place of 0, where a chain may have no value."""

Chain = Callable[[Real], Complex]
"""Factor (lines,) of acceleration over force at (lines,) rad/s."""


def on_calibrator(times: Real, chain: Chain) -> Real:
    """(2, samples) force of the hammer in N, which rests, and acceleration in m/s^2 at `times` (samples,) in s."""
    turn = 2 * np.pi * TONE
    passed = complex(chain(np.array([turn]))[0])
    tone = np.sqrt(2) * TONE_RMS * abs(passed) * np.sin(turn * times + np.angle(passed))
    return np.stack([np.zeros_like(times), tone])


def on_suspended_mass(times: Real, chain: Chain) -> Real:
    """(2, samples) force of the hammer in N and acceleration of the mass in m/s^2 at `times` (samples,) in s."""
    passed = chain(2 * np.pi * np.maximum(np.arange(PERIOD // 2 + 1.0), LEAST))
    heard = np.fft.irfft(np.fft.rfft(_blow(PLACES[:-1])) * passed, PERIOD)
    seen = np.interp(times % 1.0, PLACES, np.append(heard, heard[0]))
    return np.stack([_blow(times % 1.0), seen / SUSPENDED_MASS])


def _blow(times: Real) -> Real:
    """Force in N of the blow in the middle of each second, at `times` from 0 to 1 s."""
    return np.asarray(100.0 * np.exp(-(((times - 0.5) / 1.5e-3) ** 2)))
