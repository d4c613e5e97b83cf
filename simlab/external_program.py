"""A testing machine's own software, which runs sine points without a word to the program that measures.

It has its own order, brings each point to its amplitude by what it reads itself, holds it for a time, and comes to rest
between two points. When all are through it begins again and holds each for twice as long, for some rounds.
"""

import threading
from collections.abc import Sequence
from enum import StrEnum
from random import Random

from simlab.actuator import Actuator
from simlab.clock import Clock
from simlab.faults import Faults

ROUNDS = 8
HOLD_CYCLES, HOLD = 120.0, 5.0
"""Cycles, and s of bench time: a point is held for the longer of both in the first round."""
CORRECTIONS, SETTLING = 3, 0.4
"""How often the amplitude is corrected, and s for which it settles each time."""
STEP = 0.05  # s between two steps of a drift
DRIFT_TIME = 2.0  # s, after which a drift begins again


class ProgramFault(StrEnum):
    """What can be wrong with what it runs. What is wrong with the channels are faults of the acquisition device."""

    WRONG_AMPLITUDE = "wrong_amplitude"  # a quarter too large
    OFF_FREQUENCY = "off_frequency"  # 1 % too high
    DRIFTING_AMPLITUDE = "drifting_amplitude"  # from 0.8 to 1.2 of what it should be
    DRIFTING_FREQUENCY = "drifting_frequency"  # from 0.97 to 1.03
    WRONG_PRESET = "wrong_preset"  # half of it
    ENDS = "ends"  # it stops in the middle of a point, and does nothing more


class _OverError(Exception):
    """The program was ended."""


class ExternalProgram:
    """Drives `actuator` from a thread of its own, while it runs; calls from one thread at a time.

    Args:
        actuator: that nothing else drives.
        seed: of its order.

    Attributes:
        faults: of `ProgramFault`.
    """

    def __init__(self, actuator: Actuator, clock: Clock, seed: int = 0) -> None:
        self.faults = Faults(ProgramFault)
        self._actuator, self._clock = actuator, clock
        self._chance = Random(seed)
        self._over = threading.Event()
        self._thread: threading.Thread | None = None

    def run(self, preset: float, points: Sequence[Sequence[float]]) -> None:
        """Begin to run `points`, each a peak-to-peak amplitude in m and a frequency in Hz, about `preset` m."""
        self.rest()
        self._over.clear()
        arguments = preset, [(amplitude, frequency) for amplitude, frequency in points]
        self._thread = threading.Thread(target=self._run, args=arguments, name="external program", daemon=True)
        self._thread.start()

    def rest(self) -> None:
        """End, with the actuator at rest."""
        if self._thread is not None:
            self._over.set()
            self._thread.join()
            self._thread = None

    def _run(self, preset: float, points: list[tuple[float, float]]) -> None:
        try:
            for number in range(ROUNDS):
                self._chance.shuffle(points)
                for index, (amplitude_pp, frequency) in enumerate(points):
                    self._actuator.move(preset / 2 if self.faults.take(ProgramFault.WRONG_PRESET) else preset)
                    self._pause(1.0)
                    hold = 2**number * max(HOLD, HOLD_CYCLES / frequency)
                    if index == len(points) // 2 and self.faults.take(ProgramFault.ENDS):
                        self._point(amplitude_pp, frequency, hold / 20)
                        return
                    self._point(amplitude_pp, frequency, hold)
        except _OverError:
            pass
        finally:
            self._actuator.move(0.0)

    def _point(self, amplitude_pp: float, frequency: float, hold: float) -> None:
        amplitude_pp *= 1.25 if self.faults.take(ProgramFault.WRONG_AMPLITUDE) else 1.0
        frequency *= 1.01 if self.faults.take(ProgramFault.OFF_FREQUENCY) else 1.0
        widens = self.faults.take(ProgramFault.DRIFTING_AMPLITUDE)
        turns = self.faults.take(ProgramFault.DRIFTING_FREQUENCY)
        commanded_pp = amplitude_pp
        for _ in range(CORRECTIONS):
            self._actuator.cycle(commanded_pp, frequency)
            self._pause(0.0 if widens or turns else SETTLING)
            commanded_pp *= amplitude_pp / self._actuator.steady_pp()
        end = self._clock.now() + hold
        while (left := end - self._clock.now()) > 0 and (widens or turns):
            share = left % DRIFT_TIME / DRIFT_TIME - 0.5
            self._actuator.cycle(commanded_pp * (1 + 0.4 * share * widens), frequency * (1 + 0.06 * share * turns))
            self._pause(STEP)
        self._pause(max(left, 0.0))

    def _pause(self, duration: float) -> None:
        if self._over.wait(self._clock.wall(duration)):
            raise _OverError
