"""Sweeps on a machine that its own software drives, with drawn faults: nothing wrong is stored, nothing hangs.

Each trial draws a bench, a fault of the machine's software or of a channel (or none), when it begins, and whether STOP
is pressed. The operator accepts to end a mounting without the points that are missing. Counted are stored points that
are not what the plan says, or differ from the truth of all that the machine did; sweeps that do not end within
`PATIENCE`; and errors of no known kind.

A sensor that gives a tenth is drawn for the displacement alone: of the force nobody can know.

    python -m tests.bench.bench_external 40 7    # 40 trials, from seed 7
"""

import random
import sys
import time
from threading import Timer

from daq.errors import DaqError
from rig.control import RunControl
from rig.errors import RigError, RunStoppedError
from simlab.external_program import ProgramFault
from simlab.laboratory import Laboratory
from tests.bench.bench_testers import Trial, carried_out
from tests.rig.sweeping import Run
from tests.rig.watched import DISPLACEMENT, FORCE, PLAN, SPEED, Watched

PATIENCE = 60.0  # s
OFFERED_AFTER = 2.0  # s without a new point
LATEST = 2.0  # s after which a fault begins; a sweep without one takes some 2 s
CHANNEL_FAULTS = [
    (fault, channel)
    for fault in ("inverted", "dead", "saturated", "offset", "hum", "noisy")
    for channel in (DISPLACEMENT, FORCE)
] + [("weak", DISPLACEMENT), ("cable_open", DISPLACEMENT), ("cable_open", FORCE), ("overload", FORCE)]


def trial(seed: int) -> Trial:
    """Draw and carry out one."""
    chance = random.Random(seed)
    program, channel = chance.choice([*ProgramFault, None]), chance.choice([*CHANNEL_FAULTS, None])
    if chance.random() < 0.5:
        channel = None
    elif chance.random() < 0.8:
        program = None
    begins, presses = chance.choice((0.0, chance.uniform(0.0, LATEST))), chance.random() < 0.2
    with Laboratory(seed, SPEED) as laboratory:
        watched, control = Watched(laboratory, accepts=lambda: True), RunControl()

        def break_it() -> None:
            if program is not None:
                laboratory.program.faults.set(program)
            if channel is not None:
                laboratory.daq.faults.set(*channel)

        timers = [Timer(begins, break_it)]
        timers += [Timer(chance.uniform(0.0, LATEST), control.stop)] if presses else []
        for timer in timers:
            timer.start()
        began = time.monotonic()
        run = Run(lambda control: watched.sweep(control=control, patience=OFFERED_AFTER), control)
        run.join(PATIENCE)
        took, hung = time.monotonic() - began, run.is_alive()
        for timer in timers:
            timer.cancel()
        wrong = [f"no end after {PATIENCE:g} s"] if hung else watched.wrong_points()
        if run.error is not None and not isinstance(run.error, RigError | DaqError | RunStoppedError):
            wrong.append(f"{type(run.error).__name__}: {run.error}")
        if run.error is None and not watched.offers and len(watched.points) != PLAN.points:
            wrong.append(f"{len(watched.points)} points, and nobody was told")
        control.stop()
        run.join(PATIENCE)
    names = [*filter(None, (program,)), *([f"{channel[0]} {channel[1][-3:]}"] if channel else [])]
    ended = "complete" if run.error is None else type(run.error).__name__
    return Trial("external", " + ".join(names) or "none", ended, tuple(wrong), took, len(watched.points))


def main(count: int = 300, seed: int = 1) -> None:
    """Carry out `count` trials."""
    carried_out(trial, count, seed)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
