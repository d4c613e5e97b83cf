"""The displacement channel of the acquisition device as a witness of whether the actuator is at rest.

A tester measures itself: its own status cannot show that every value in it is wrong. The task that records a sweep has
displacement on another line. The witness looks at it through this task only, between two records.
"""

import logging
import math
import threading
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import detrend

from daq.block import Block
from daq.errors import DaqError
from daq.instrument import OnDemand
from rig.tester.rest_judge import REST_PP

LOOK = 0.2  # s
PATIENCE = 0.4  # s that the device may take beyond a look, the end of a cancelled record included
BEYOND_NOISE = 2.0  # times the motion that the channel showed at rest
SINE = 8**0.5  # peak-to-peak value of a sine over its standard deviation

log = logging.getLogger(__name__)


def oscillation_pp(displacement: ArrayLike) -> float:
    """Oscillation throughout a record: peak-to-peak value in m of the sine with the same standard deviation.

    The record is divided into halves, the linear trend of each half is removed, and the quieter half counts. So a drift
    is no oscillation, nor is a spike or the end of a ramp, which is in one half only. Of the peak-to-peak value of a
    sine, the result is at least 0.06 times where a half holds 0.4 cycles, and at least 0.6 times where it holds one.

    Args:
        displacement: (samples,) in m, four or more.
    """
    return min(SINE * float(np.std(detrend(half))) for half in np.array_split(np.asarray(displacement), 2))


class DisplacementWitness:
    """Records by `recorder`, and looks at its channel ``displacement`` when a tester says that it rests.

    One thread at a time uses the recorder; a look by another thread waits for it, `PATIENCE` s at most.
    """

    def __init__(self, recorder: OnDemand) -> None:
        self._recorder = recorder
        self._in_use = threading.Lock()
        self._limit = math.inf  # m peak to peak; nothing is known of the channel yet

    def record(self, duration: float, cancelled: Callable[[], bool]) -> Block:
        """The next `duration` s; errors as for `OnDemand.record`."""
        with self._in_use:
            return self._recorder.record(duration, cancelled=cancelled)

    def learn(self, cancelled: Callable[[], bool]) -> None:
        """Learn the noise of the channel, hum included, from an actuator that holds its preset and has not cycled yet.

        Raises DaqError as `OnDemand.record`.
        """
        noise_pp = oscillation_pp(self.record(LOOK, cancelled).value("displacement"))
        self._limit = max(REST_PP, BEYOND_NOISE * noise_pp)

    def motion_pp(self) -> float | None:
        """Oscillation now, m peak to peak; None where it is within the noise or not known.

        Takes `LOOK + 2 * PATIENCE` s at most. A device that did not answer is not asked again before the next `learn`.
        """
        if math.isinf(self._limit):
            return None
        limit, found = self._limit, list[float]()
        looking = threading.Thread(target=self._look, args=(found,), name="displacement witness", daemon=True)
        looking.start()
        looking.join(LOOK + 2 * PATIENCE)
        if not found:
            self._limit = math.inf
            log.warning(
                "the displacement channel does not tell; whether the actuator rests is known by the tester alone"
            )
            return None
        return found[0] if found[0] > limit else None

    def _look(self, found: list[float]) -> None:
        if not self._in_use.acquire(timeout=PATIENCE):
            return
        try:
            block = self._recorder.record(LOOK, timeout=PATIENCE)
            if "displacement" not in block.overloaded:
                found.append(oscillation_pp(block.value("displacement")))
        except DaqError as error:
            log.warning("%s", error)
        finally:
            self._in_use.release()
