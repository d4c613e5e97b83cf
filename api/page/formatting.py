"""What the page says in words: quantities with their units, interlocks, and how long something will take."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import pairwise
from statistics import median

from jointlab import durations
from jointlab.report.section import ends, number
from jointlab.supervision.phase import Phase
from jointlab.supervision.state import RigState
from rig.registers import Interlock
from store.runs import Run
from store.states import RunState

THIN = "\u202f"
"""A narrow space that keeps a number and its unit on one line."""

INTERLOCKS = {
    Interlock.UPPER_DISPLACEMENT: "The actuator went above its displacement limit.",
    Interlock.LOWER_DISPLACEMENT: "The actuator went below its displacement limit.",
    Interlock.FORCE: "The force limit was exceeded.",
    Interlock.ERROR: "The actuator did not follow what it was told.",
    Interlock.UNDERPEAK: "The amplitude stayed below what was asked for.",
    Interlock.WATCHDOG: "The tester heard nothing from the program for too long.",
    Interlock.EMERGENCY_STOP: "The emergency stop on the machine is pressed.",
}
_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"))


def quantity(value: float | None, unit: str, digits: int = 3) -> str:
    """A number with its unit, such as 1 234 Hz; a dash where it is not known."""
    if value is None or value != value:
        return "–"
    return f"{number(value, digits)}{THIN}{unit}" if unit else number(value, digits)


def scaled(value: float | None, unit: str, digits: int = 3) -> str:
    """The same with the prefix that suits the size: 1.23 MN/m."""
    if value is None or value != value:
        return "–"
    scale, prefix = next(((s, p) for s, p in _PREFIXES if abs(value) >= s), (1.0, ""))
    return quantity(value / scale, f"{prefix}{unit}", digits)


def interval(low: float | None, high: float | None, scale: float = 1.0, unit: str = "", digits: int = 3) -> str:
    """Both ends of an interval in `unit`, which is `scale` of the SI one."""
    if low is None or high is None:
        return "–"
    text = ends((low / scale, high / scale), digits)
    return f"{text}{THIN}{unit}" if unit and text != "–" else text


def duration(seconds: float) -> str:
    """A length of time as people say it."""
    return durations.duration(seconds, THIN)


def moment(at: datetime | None) -> str:
    """A UTC time by the clock of this computer."""
    return "–" if at is None else f"{at.replace(tzinfo=at.tzinfo or UTC).astimezone():%Y-%m-%d %H:%M:%S}"


def standing(run: Run, rig: RigState | None) -> str:
    """How a run stands: one that the store believes to be running and this rig does not carry out was cut off.

    Args:
        run: as it is stored.
        rig: what the rig of this service is at; None where it drives none, and cannot know.
    """
    if run.state is RunState.RUNNING and rig is not None and (rig.phase is Phase.IDLE or rig.run_id != run.id):
        return "cut off"
    return run.state.value


def time_left(times: Sequence[datetime], left: int, latest: int = 20) -> float | None:
    """Seconds that `left` more take at the pace of the latest; None where there is no pace yet or nothing left.

    Half of the latest gaps are longer than the one that counts: a hold, a mounting or a night between says nothing.
    """
    recent = sorted(times)[-latest - 1 :]
    if left <= 0 or len(recent) < 2:
        return None
    return left * median((later - earlier).total_seconds() for earlier, later in pairwise(recent))
