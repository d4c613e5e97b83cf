"""Sweeps on testers with our registers and with others, with drawn faults: nothing wrong is stored, nothing hangs.

Each trial draws a map, a fault, when it begins and how often it shows, and whether STOP is pressed. It ends when the
sweep has ended. Counted are points that differ from the truth of what they were recorded in, sweeps that do not end
within `PATIENCE`, actuators that move afterwards although rest was not said to be unknown, and errors of no known kind.

    python -m tests.bench.bench_testers 40 7    # 40 trials, from seed 7
"""

import random
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from threading import Timer

from daq.errors import DaqError
from rig.control import RunControl
from rig.errors import RigError, RunStoppedError
from rig.sequences.sweep_plan import SweepPlan
from rig.tester.driver import MOTION_TIMEOUT
from rig.tester.missing_functions import Lack
from rig.tester.register_map import OURS, TesterMap
from rig.tester.status import ActuatorNotAtRestError, LineLostError
from simlab.plc_tester import PlcFault
from simlab.tester_server import TesterFault
from tests.rig.mapped import MappedLaboratory, bare_map, example_map, mapped_laboratory, wrong_points
from tests.rig.sweeping import Run

PATIENCE = MOTION_TIMEOUT + 15.0  # s; a preset that the controller does not take over is told after the former
REST_WITHIN = 2.5  # s after the end: the watchdog, on a busy computer
LATEST, LATEST_OF_OURS = 4.0, 0.4  # s after which a fault begins; a sweep without one takes some 3 s, on ours 0.3 s
PLAN = SweepPlan(frequencies=(50.0, 150.0), amplitudes_pp=(1e-4, 3e-5), configurations=("shear",), specimens=("I",))
MAPS: dict[str, Callable[[], TesterMap]] = {
    "ours": lambda: OURS,
    "other registers": example_map,
    "without watchdog": partial(example_map, watchdog=False),
    "as little as possible": bare_map,
}
COMMON = (
    TesterFault.REFUSE, TesterFault.BUSY, TesterFault.LOST_REPLY, TesterFault.SILENT, TesterFault.CUT, TesterFault.DROP,
    TesterFault.WEAK_SERVO, TesterFault.RUNAWAY_SERVO, TesterFault.DEAD_WATCHDOG, TesterFault.DEAD_EMERGENCY_STOP,
)  # fmt: skip
OURS_ALONE = (TesterFault.FLIPPED_COMMAND, TesterFault.FLIPPED_STATUS)


@dataclass(frozen=True)
class Trial:
    """How one sweep went: the name of its map, its fault, how it ended and what is wrong about it."""

    map_name: str
    fault: str
    ended: str
    wrong: tuple[str, ...]
    took: float
    points: int


def trial(seed: int) -> Trial:
    """Draw and carry out one."""
    chance = random.Random(seed)
    name = list(MAPS)[seed % len(MAPS)]
    faults = (*COMMON, *(OURS_ALONE if name == "ours" else set(PlcFault) - {PlcFault.OTHER_TYPE}))
    fault = chance.choice(sorted(faults))
    times = chance.choice((1, 2, 5, None, None))
    latest = LATEST_OF_OURS if name == "ours" else LATEST
    begins, presses, pressed = chance.uniform(0.0, latest), chance.random() < 0.3, chance.uniform(0.0, latest)
    with mapped_laboratory(MAPS[name](), PLAN, seed) as laboratory:
        control = RunControl(laboratory.latch)
        timers = [Timer(begins, laboratory.tester.faults.set, (fault, times))]
        timers += [Timer(pressed, control.stop)] if presses else []
        for timer in timers:
            timer.start()
        began = time.monotonic()
        run = Run(laboratory.sweep, control)
        run.join(PATIENCE)
        took, hung = time.monotonic() - began, run.is_alive()
        for timer in timers:
            timer.cancel()
        wrong = [f"no end after {PATIENCE:g} s"] if hung else _wrong(laboratory, run.error)
        laboratory.tester.faults.clear()
        laboratory.tester.emergency_stop()
        ended = "complete" if run.error is None else type(run.error).__name__
        how = f"{fault}{'' if times is None else f' x {times}'}{', STOP' if presses else ''}"
        return Trial(name, how, ended, tuple(wrong), took, len(laboratory.points))


def _wrong(laboratory: MappedLaboratory, error: Exception | None) -> list[str]:
    wrong = wrong_points(laboratory)
    if error is not None and not isinstance(error, RigError | DaqError | RunStoppedError):
        wrong.append(f"{type(error).__name__}: {error}")
    if error is None and len(laboratory.points) != PLAN.points:
        wrong.append(f"{len(laboratory.points)} points and no error")
    # without a watchdog, or with a dead one, a machine that cannot be reached moves on, and is said to
    notes = " ".join(getattr(error, "__notes__", ()))
    unknown = isinstance(error, LineLostError | ActuatorNotAtRestError) or "not confirmed at rest" in notes
    left = Lack.WATCHDOG in laboratory.tester_map.lacks or not laboratory.tester.device.watchdog_works
    end = time.monotonic() + REST_WITHIN
    while (moves := laboratory.tester.device.is_moving()) and time.monotonic() < end:
        time.sleep(0.01)
    if moves and not (unknown and left):
        wrong.append(f"it moves on after {error}")
    return wrong


def carried_out(draw: Callable[[int], Trial], count: int, seed: int) -> None:
    """Carry out `count` trials, drawn from `seed` on, and print what became of them."""
    trials = list[Trial]()
    for number in range(count):
        trials.append(each := draw(seed + number))
        marks = "".join(f"\n      WRONG {what}" for what in each.wrong)
        print(
            f"{seed + number:4} {each.map_name:<22}{each.fault:<40}{each.ended:<28}{each.points:2} points"
            f"{each.took:7.1f} s{marks}",
            flush=True,
        )
    by_map = defaultdict[str, list[Trial]](list)
    for each in trials:
        by_map[each.map_name].append(each)
    for name, group in by_map.items():
        points, wrong = sum(each.points for each in group), sum(bool(each.wrong) for each in group)
        longest = max(each.took for each in group)
        print(f"{name:<22}{len(group):4} trials{points:5} points, {wrong} wrong, longest {longest:.1f} s")
        print("  " + ", ".join(f"{ended} {number}" for ended, number in Counter(t.ended for t in group).most_common()))


def main(count: int = 500, seed: int = 1) -> None:
    """Carry out `count` trials."""
    carried_out(trial, count, seed)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
