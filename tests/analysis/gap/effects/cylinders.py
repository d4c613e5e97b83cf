"""Cylinders and the states of motion in which effects of the elastomer are read."""

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import Effect, Given
from analysis.gap.simulation.blow_motion import blow_amplitudes_of

STORAGE = np.array([4e5, 2.4e6, 20.0])[None, :, None, None]
LOSS = 0.1 * STORAGE
CYLINDERS = Cylinders(STORAGE, LOSS)


def in_tester(
    amplitude: Real | float = 25e-6, frequency: Real | float = 50.0, fraction: Real | float = 0.0, angled: bool = False
) -> Loading:
    """In the tester; arguments broadcast."""
    x, f, done = (
        np.array(each, dtype=float) for each in np.broadcast_arrays(*np.atleast_1d(amplitude, frequency, fraction))
    )
    return Loading(True, f, x, None, done, np.full(x.size, angled))


def struck(motion: Real | None = None, frequency: Real | float = 50.0) -> Loading:
    """Under the beam; `motion` (2,) m in shear and in compression."""
    f = np.atleast_1d(np.asarray(frequency, dtype=float))
    amplitudes = (
        None if motion is None else blow_amplitudes_of(np.log(motion)[None], np.eye(1), np.zeros(1, dtype=np.intp))
    )
    return Loading(False, f, np.full(f.size, np.nan), amplitudes, np.zeros(f.size), np.zeros(f.size, bool))


def ratios(effect: Effect, given: Given, loading: Loading) -> tuple[Real, Real]:
    """(3, n) storage and loss over what they were: shear, compression, rotation."""
    found = effect.cylinders(given, CYLINDERS, loading)
    shape = np.broadcast_shapes(found.storage.shape, found.loss.shape, (1, 3, 1, loading.frequency.size))
    storage, loss = (np.broadcast_to(each, shape)[0, :, 0] for each in (found.storage, found.loss))
    return storage / STORAGE[0, :, 0], loss / LOSS[0, :, 0]
