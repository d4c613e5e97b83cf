"""The tester's limit detectors: what each watches, and how it may be set."""

from collections.abc import Mapping
from dataclasses import dataclass

from rig.registers import DETECTED, Action, Interlock, Value, name_of

TIGHTER_IS_HIGHER = Interlock.LOWER_DISPLACEMENT | Interlock.UNDERPEAK  # of the others, a lower limit is tighter


@dataclass(frozen=True)
class SimulatedDetector:
    """A limit in the unit of the watched quantity, and the action beyond it."""

    limit: float
    action: Action


@dataclass(frozen=True)
class Motion:
    """The quantities that detectors watch, at one moment; m and N, peak values unless named otherwise."""

    highest: float
    lowest: float
    force: float
    amplitude_pp: float
    commanded_pp: float  # 0 when not cycling
    previous_pp: float  # amplitude when that was commanded
    steady: bool


class Detectors:
    """The detectors as they were set at the instrument, and as the network has tightened them since."""

    def __init__(self, set_at_instrument: Mapping[Interlock, SimulatedDetector]) -> None:
        self._widest = dict(set_at_instrument)
        self._in_force = dict(set_at_instrument)

    def __getitem__(self, interlock: Interlock) -> SimulatedDetector:
        return self._in_force[interlock]

    def tighten(self, interlock: Interlock, detector: SimulatedDetector) -> None:
        """Put `detector` in force, in place of whatever was."""
        self._in_force[interlock] = detector

    def may_be(self, interlock: int, limit: float, action: int) -> bool:
        """Whether there is such a detector, and it would be as tight as at the instrument or tighter."""
        widest = self._widest.get(Interlock(interlock))
        if widest is None or action not in set(Action) or action < widest.action:
            return False
        # written so that a value that is not a number is refused; the instrument's own limit went over the wire once
        slack = 1e-6 * abs(widest.limit)
        if interlock & TIGHTER_IS_HIGHER:
            return limit >= widest.limit - slack
        return limit <= widest.limit + slack

    def firing(self, motion: Motion) -> Interlock:
        """The detectors beyond their limits in `motion`."""
        cycling = motion.commanded_pp > 0.0
        # on the way down from a larger amplitude, the way is no overshoot
        allowed_pp = motion.commanded_pp if motion.steady else max(motion.commanded_pp, motion.previous_pp)
        limit = {interlock: detector.limit for interlock, detector in self._in_force.items()}
        beyond = {
            Interlock.UPPER_DISPLACEMENT: motion.highest > limit[Interlock.UPPER_DISPLACEMENT],
            Interlock.LOWER_DISPLACEMENT: motion.lowest < limit[Interlock.LOWER_DISPLACEMENT],
            Interlock.FORCE: motion.force > limit[Interlock.FORCE],
            Interlock.ERROR: cycling and motion.amplitude_pp - allowed_pp > limit[Interlock.ERROR],
            Interlock.UNDERPEAK: cycling
            and motion.steady
            and motion.amplitude_pp < limit[Interlock.UNDERPEAK] * motion.commanded_pp,
        }
        return Interlock(sum(interlock for interlock, is_beyond in beyond.items() if is_beyond))

    def action_of(self, interlock: Interlock) -> Action:
        """The action when `interlock` fires."""
        return self[interlock].action if interlock in self._in_force else Action.HYDRAULIC_INTERLOCK

    def values(self) -> dict[str, Value]:
        """Values of the DETECTORS block."""
        values: dict[str, Value] = {}
        for interlock in DETECTED:
            values[f"{name_of(interlock)}_limit"] = self[interlock].limit
            values[f"{name_of(interlock)}_action"] = self[interlock].action
        return values
