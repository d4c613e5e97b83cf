"""200 mutated testers: from a STOP, or from a fault that shows by itself, to rest of the actuator by its own physics.

Each is a sweep in real time on a tester that goes wrong at a random moment of cycling. A mutant that obeys nothing is
stopped by the coil of the emergency stop, one whose line or coil is dead by its watchdog.
"""

import random
import statistics
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from daq import device
from rig.control import RunControl
from rig.errors import RigError, RunStoppedError
from rig.registers import CommandCode, State
from rig.sequences.sweep_plan import SweepPlan
from rig.sweep.driven_sweep import run_sweep
from rig.tester import driver as tester
from rig.tester.status import ActuatorNotAtRestError
from rig.tester.stop_latch import StopLatch
from rig.thermometer import Thermometer
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.daq_server import start_daq_server
from simlab.thermometer_server import start_thermometer_server
from tests import mutated_tester as wrong
from tests.channels import TESTER_CHANNELS
from tests.fault_proxy import FaultProxy, Impairment, Way
from tests.mutated_tester import Answer, AnsweringProxy, MutatedDevice, Mutation
from tests.rig.sweeping import SweepLaboratory

PLAN = SweepPlan(
    frequencies=(20.0, 50.0, 100.0),
    amplitudes_pp=(1e-4,),
    preset=1.5e-4,
    configurations=("shear",),
    specimens=("I",),
    shortest_record=8.0,
)
TARGET, DEAD_TARGET = 1.0, 3.0  # s to rest; the second where the line or the coil is dead and the watchdog is left
PATIENCE = 20.0  # s
HOLD, OFF = CommandCode.HOLD, CommandCode.HYDRAULICS_OFF


@dataclass(frozen=True)
class Mutant:
    """One way to be wrong.

    Attributes:
        kind: for the table.
        mutation: of the device.
        answer: of the line, in place of its replies.
        impairment: of the line.
        shows: whether it has to be found without a STOP.
        dead: whether the line or the coil is dead, so that the watchdog is left.
    """

    kind: str
    mutation: Mutation = wrong.SOUND
    answer: Answer | None = None
    impairment: Impairment | None = None
    cut: bool = False
    shows: bool = False
    dead: bool = False


Draw = Callable[[random.Random], Mutant]


def _lie(kind: str, lie: wrong.Lie, shows: bool = True) -> Mutant:
    return Mutant(kind, Mutation(lie=lie), shows=shows)


def _impossible(chance: random.Random) -> Mutant:
    name = chance.choice(sorted(wrong.IMPOSSIBLE))
    return _lie("a value outside of the map", wrong.says(**{name: wrong.IMPOSSIBLE[name]}))


def _frozen(chance: random.Random) -> Mutant:
    return _lie("a frozen counter", wrong.frozen_values(chance.choice(("cycles", "heartbeat"))))


def _frozen_amplitude(_: random.Random) -> Mutant:
    return _lie("frozen amplitudes", wrong.frozen_values("displacement_pp"), shows=False)


def _other(chance: random.Random) -> Mutant:
    off = {chance.choice(("transaction", "unit", "function")): chance.randint(1, 100)}
    return Mutant("replies to another request", answer=wrong.other(**off), shows=True, dead=True)


def _lossy(chance: random.Random) -> Mutant:
    answer = chance.choice((wrong.never, wrong.late(0.5), wrong.echo))
    return Mutant("one reply in four lost, late or echoed", answer=wrong.sometimes(chance, 0.25, answer))


def _cycling_share(chance: random.Random) -> Mutant:
    names = chance.sample(("force_mean", "force_pp", "displacement_pp"), 2)
    return _lie("measured values off by some %", wrong.scaled(chance.uniform(0.9, 1.04), *names), shows=False)


KINDS: tuple[Draw, ...] = (
    lambda _: Mutant("disobeys HOLD, openly", Mutation(disobeys=frozenset({HOLD}))),
    lambda _: Mutant("disobeys HOLD, says held", Mutation(disobeys=frozenset({HOLD}), pretends=True)),
    lambda _: Mutant("disobeys HOLD and OFF, says so", Mutation(disobeys=frozenset({HOLD, OFF}), pretends=True)),
    lambda _: Mutant("disobeys HYDRAULICS_OFF", Mutation(disobeys=frozenset({OFF}), pretends=True)),
    lambda chance: Mutant("ramps down slowly, 0.2 to 0.8 s", Mutation(stopping_time=chance.uniform(0.03, 0.12))),
    lambda chance: Mutant("ramps down without end", Mutation(stopping_time=chance.uniform(5.0, 60.0))),
    lambda _: Mutant("travels away at HOLD", Mutation(runs_away=True)),
    lambda _: Mutant(
        "disobeys HOLD and the coil", Mutation(disobeys=frozenset({HOLD, OFF}), coil_is_dead=True), dead=True
    ),
    lambda _: Mutant("disobeys all, rests in every value", wrong.LIAR),
    lambda _: Mutant("the same, and the coil is dead", replace(wrong.LIAR, coil_is_dead=True), dead=True),
    lambda _: Mutant("freezes STATUS", Mutation(frozen=True), shows=True),
    lambda _: Mutant("freezes STATUS, disobeys", Mutation(disobeys=frozenset({HOLD, OFF}), frozen=True), shows=True),
    _impossible,
    _frozen,
    _frozen_amplitude,
    lambda _: _lie("says held while it cycles", wrong.says_rest),
    lambda chance: _lie("another command in force", wrong.scaled(chance.uniform(1.1, 2.0), "amplitude", "frequency")),
    lambda chance: _lie("sequence number reset", wrong.says(sequence=chance.choice((0, 1, 30_000, 60_000)))),
    lambda chance: _lie(
        "force or position beyond the limits",
        chance.choice((wrong.says(force_mean=24e3), wrong.says(displacement_mean=8e-3))),
    ),
    _cycling_share,
    lambda chance: Mutant("replies late", answer=wrong.late(chance.uniform(0.02, 0.14))),
    lambda chance: Mutant("replies too late", answer=wrong.late(chance.uniform(0.3, 2.0)), shows=True, dead=True),
    lambda chance: Mutant(
        "replies byte by byte", answer=wrong.trickling(chance.uniform(0.005, 0.05)), shows=True, dead=True
    ),
    lambda _: Mutant("echoes requests", answer=wrong.echo, shows=True, dead=True),
    _other,
    lambda _: Mutant("replays old replies", answer=wrong.stale(), shows=True),
    _lossy,
    lambda _: Mutant("every reply damaged", impairment=Impairment(flipped=Way.REPLIES), shows=True, dead=True),
    lambda _: Mutant("half-open: nothing passes", impairment=Impairment(lost=Way.BOTH), shows=True, dead=True),
    lambda _: Mutant("replies lost", impairment=Impairment(lost=Way.REPLIES), shows=True, dead=True),
    lambda _: Mutant("line cut, connections refused", cut=True, shows=True, dead=True),
    lambda _: Mutant("reset at every request", impairment=Impairment(reset=Way.REQUESTS), shows=True, dead=True),
    lambda _: Mutant("disobeys HOLD, late replies", Mutation(disobeys=frozenset({HOLD})), answer=wrong.late(0.05)),
)


@dataclass(frozen=True)
class Outcome:
    """What came of one: s to rest by the physics, s to the end of the run, and whether rest was claimed too early."""

    mutant: Mutant
    to_rest: float
    to_end: float
    claimed: bool


def trial(mutant: Mutant, seed: int, chance: random.Random) -> Outcome:
    """Start a sweep, let the tester go wrong, press STOP where it takes one, and time it."""
    bench = ordinary_bench(seed, Clock(1.0))
    daq = start_daq_server(bench)
    thermometer = start_thermometer_server(bench)
    try:
        with wrong.mutated_tester(bench) as (controller, line):
            proxy = FaultProxy(line.url.removeprefix("tcp://"), seed)
            try:
                laboratory = SweepLaboratory(PLAN, bench, daq, None, thermometer)  # type: ignore[arg-type]  # below
                return _timed(mutant, laboratory, controller, line, proxy, chance)
            finally:
                proxy.stop()
    finally:
        daq.stop()
        thermometer.stop()


def _timed(
    mutant: Mutant,
    laboratory: SweepLaboratory,
    controller: MutatedDevice,
    line: AnsweringProxy,
    proxy: FaultProxy,
    chance: random.Random,
) -> Outcome:
    latch, ended = StopLatch(), list[tuple[float, bool]]()
    control = RunControl(latch)
    run = threading.Thread(target=lambda: ended.append(_sweep(laboratory, proxy, latch, control)))
    run.start()
    _until(lambda: controller.status()["state"] == State.SETTLED)
    time.sleep(chance.uniform(0.0, 0.6))
    began = time.monotonic()
    _go_wrong(mutant, controller, line, proxy)
    claimed = False
    if not mutant.shows:
        time.sleep(chance.uniform(0.0, 0.3))
        began = time.monotonic()
        latch.stop("bench", "STOP was pressed")
        stopping = threading.Thread(target=partial(_press, control))
        stopping.start()
    _until(controller.rests)
    rest = time.monotonic()
    run.join(PATIENCE)
    end, claimed = ended[0]
    return Outcome(mutant, rest - began, end - began, claimed and end < rest)


def _press(control: RunControl) -> None:
    try:
        control.stop()
    except RigError:
        return  # told by the run, too


def _go_wrong(mutant: Mutant, controller: MutatedDevice, line: AnsweringProxy, proxy: FaultProxy) -> None:
    controller.mutate(mutant.mutation)
    if mutant.answer is not None:
        line.answer = mutant.answer
    if mutant.impairment is not None:
        proxy.impair(mutant.impairment)
    if mutant.cut:
        proxy.cut()


def _sweep(laboratory: SweepLaboratory, proxy: FaultProxy, latch: StopLatch, control: RunControl) -> tuple[float, bool]:
    """When the run ended, and whether it claims that the actuator is at rest."""
    claims = True
    try:
        with (
            device.connect(laboratory.daq.address) as chassis,
            chassis.record(TESTER_CHANNELS, 5120.0, 9.0) as recorder,
            Thermometer(laboratory.thermometer.url, 0.5) as thermometer,
            tester.connect(f"tcp://{proxy.address}", latch=latch) as driver,
        ):
            run_sweep(PLAN, driver, recorder, thermometer, laboratory, laboratory, control=control)
    except RunStoppedError as error:
        claims = not hasattr(error, "__notes__")
    except ActuatorNotAtRestError:
        claims = False
    except RigError as error:
        claims = not any("not confirmed at rest" in note for note in getattr(error, "__notes__", ()))
    return time.monotonic(), claims


def _until(holds: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not holds():
        if time.monotonic() > end:
            raise TimeoutError("waited in vain")
        time.sleep(0.002)


def main(count: int = 200, seed: int = 17, kinds: Sequence[Draw] = KINDS) -> None:
    """Try `count` mutants, each kind as often as the others; print times by kind, in s."""
    chance, outcomes = random.Random(seed), list[Outcome]()
    for number in range(count):
        mutant = kinds[number % len(kinds)](chance)
        outcomes.append(trial(mutant, seed + number, chance))
        late = outcomes[-1].to_rest > (DEAD_TARGET if mutant.dead else TARGET)
        print(f"{number:4} {mutant.kind:<42}{outcomes[-1].to_rest:7.3f}{' LATE' if late else ''}", flush=True)
    show(outcomes)


def show(outcomes: list[Outcome]) -> None:
    """Print the table."""
    by_kind = defaultdict[tuple[bool, str], list[Outcome]](list)
    for outcome in outcomes:
        by_kind[outcome.mutant.dead, outcome.mutant.kind].append(outcome)
    print(
        f"{'mutant':<44}{'number':>7}{'median':>9}{'worst':>9}{'run ended':>11}{'target':>8}{'late':>6}{'claimed':>9}"
    )
    for (dead, kind), group in sorted(by_kind.items()):
        times, target = [each.to_rest for each in group], DEAD_TARGET if dead else TARGET
        print(
            f"{kind:<44}{len(group):>7}{statistics.median(times):>9.3f}{max(times):>9.3f}"
            f"{max(each.to_end for each in group):>9.3f}{target:>8g}{sum(time > target for time in times):>6}"
            f"{sum(each.claimed for each in group):>9}"
        )
    for dead, name in ((False, "STOP obeyed or emergency stop"), (True, "line or coil dead")):
        if not (times := [each.to_rest for each in outcomes if each.mutant.dead is dead]):
            continue
        within = sum(time <= (DEAD_TARGET if dead else TARGET) for time in times)
        median, worst = statistics.median(times), max(times)
        print(f"{name}: {within} of {len(times)} in time, median {median:.3f} s, worst {worst:.3f} s")
    print(f"rest claimed before it was: {sum(each.claimed for each in outcomes)}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
