"""Judging whether an actuator that was told to stop does so: by what it measures, not by what it acknowledges."""

import math
from enum import Enum, auto

from rig.registers import State
from rig.tester.status import TesterStatus, state_text

ESCALATE = 0.3
"""Time in s without visible progress of a stop after which the emergency stop is tripped; with the time that writing
its coil may take on a bad line, that is within 0.5 s of the request (stop category 1 becomes 0, IEC 60204-1, 9.2.2)."""
LONGEST_RAMP = 3.0
"""Longest ramp in s down to rest that an instrument is given, however steadily the amplitude falls."""
FALL = 0.9
"""Share of its former value that a measured amplitude has to fall to within `ESCALATE`, to be on the way to rest."""
REST_PP = 5e-6
"""Measured peak-to-peak displacement in m below which an actuator does not cycle: half the smallest test amplitude."""
SURE = 0.1
"""Time in s that an instrument has to report rest before it is believed, if no complete cycle since confirms it."""
STILL = 2e-6
"""Largest change of the mean position in m, between two looks that are compared, at which the position is held."""
LOOKS_APART = 0.01
"""Shortest time in s between two looks whose mean positions are compared."""

AT_REST = frozenset({State.HYDRAULICS_OFF, State.IDLE, State.HELD, State.TRIPPED})
"""States in which an instrument says that the actuator is at rest."""
POWERLESS = frozenset({State.HYDRAULICS_OFF, State.TRIPPED})
"""States in which the actuator is not driven; the specimen may push it back, and after a trip it may still move."""


def motion_shown(status: TesterStatus, before: TesterStatus | None) -> str | None:
    """What a status shows of motion of an actuator that nobody drives, in words; None where it shows none.

    Args:
        before: read since it was driven last, and long enough ago for a cycle; None: there is none.
    """
    if status.state not in AT_REST:
        return f"the tester reports that it is {state_text(status.state)}"
    if status.amplitude_pp != 0.0:
        return f"the tester reports that it is {state_text(status.state)}, with an amplitude in force"
    cycles_on = before is not None and status.cycles > before.cycles
    if cycles_on and max(status.displacement_pp[:1], default=0.0) > REST_PP:
        return f"the actuator cycles (the tester reports that it is {state_text(status.state)})"
    return None


def shows_rest(status: TesterStatus, before: TesterStatus | None) -> bool:
    """Whether two statuses show that an actuator that nobody drives rests; `before` as for `motion_shown`.

    One status is not enough: only two show whether cycles are counted and whether the mean position is held.
    """
    if before is None or before.state not in AT_REST or motion_shown(status, before) is not None:
        return False
    return status.state in POWERLESS or abs(status.displacement_mean - before.displacement_mean) <= STILL


class StopProgress(Enum):
    """How far a stop has come."""

    RESTS = auto()
    STOPPING = auto()
    MOVES = auto()  # and goes on moving: only the emergency stop helps


class RestJudge:
    """Judges successive statuses since a stop was asked for at `began`, s of `time.monotonic`."""

    def __init__(self, began: float) -> None:
        self._began = began
        self._progress = began
        self._lowest_pp = math.inf
        self._claim: tuple[float, int] | None = None  # when the instrument first said that it rests, and its cycles
        self._held_at: tuple[float, float] | None = None  # when, and mean position
        self._still = False

    def judge(self, status: TesterStatus, now: float) -> StopProgress:
        """How far the stop has come by `status`, which was read at `now`."""
        if status.state in AT_REST and status.amplitude_pp == 0.0:
            if self._claim is None:
                self._claim = (now, status.cycles)
                self._progress = now
            if self._is_believed(status, now):
                return StopProgress.RESTS
        else:
            self._claim = None
            still, falls = self._is_still(status.displacement_mean, now), self._falls(status)
            if status.state is State.RAMPING and status.amplitude_pp == 0.0 and still and falls:
                self._progress = now
        is_late = now - self._progress > ESCALATE or now - self._began > LONGEST_RAMP
        return StopProgress.MOVES if is_late else StopProgress.STOPPING

    def _is_believed(self, status: TesterStatus, now: float) -> bool:
        """Whether nothing that is measured speaks against rest."""
        assert self._claim is not None, "rest is claimed"
        since, cycles = self._claim
        powerless = status.state in POWERLESS
        still = powerless or self._is_still(status.displacement_mean, now)
        if status.displacement_pp and status.displacement_pp[0] > REST_PP:
            # from before the claim, unless cycles are still counted
            return still and status.cycles == cycles and now - since >= SURE
        return still and (status.state is not State.TRIPPED or bool(status.displacement_pp) or now - since >= SURE)

    def _is_still(self, mean: float, now: float) -> bool:
        if self._held_at is None or now - self._held_at[0] >= LOOKS_APART:
            self._still = self._held_at is not None and abs(mean - self._held_at[1]) <= STILL
            self._held_at = (now, mean)
        return self._still

    def _falls(self, status: TesterStatus) -> bool:
        latest_pp = max(status.displacement_pp[:1], default=math.inf)
        if latest_pp > FALL * self._lowest_pp or latest_pp == math.inf:
            return False
        self._lowest_pp = latest_pp
        return True
