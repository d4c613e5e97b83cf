"""Runs that are killed (SIGKILL) at random moments and resumed until they are done: nothing lost, nothing doubled.

The process that measures is a child; what it acknowledged it writes to a file, line by line, after the store has
answered. The plant is deterministic: no noise to speak of, no scatter, no drift of the room, one order of points. What
is left to chance is when things happen: an approach to an amplitude ends a little elsewhere within its tolerance, a
blow falls elsewhere between two samples, interrupted or not. So each k + ih is held against the bench's own at the
amplitude that was reached, and both experiments against those of a run that nobody interrupted.
"""

import multiprocessing
import os
import random
import signal
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from sqlalchemy import text

from api.commands.sequences import named_sequence
from jointlab.identification.load import measurement_of_run
from jointlab.identification.measurement import MeasuredArticle
from jointlab.instruments import instruments_of
from jointlab.runs.carry_out import run_sequence, store_spools
from jointlab.trials.simulated_laboratory import simulated_settings
from jointlab.trials.simulated_operator import SimulatedOperator
from rig.events import BlowAccepted, BlowRefused, Event, SinePointMeasured
from rig.registers import State
from rig.sequences.sequence import Sequence as SequenceDocument
from rig.sequences.sequence import sequence_from
from simlab.actuator import Dwell, Servo
from simlab.bench import SimulatedBench
from simlab.elastomer import REFERENCE_TEMPERATURE
from simlab.laboratory import Addresses, Laboratory
from simlab.operator_server import OperatorClient
from simlab.ordinary import BenchConditions
from store.catalogue import Catalogue
from store.measurements.blows import list_blows
from store.measurements.locks import run_lock
from store.measurements.runs import Run, list_run_events, list_runs
from store.measurements.sine_records import list_sine_records
from store.states import RunState
from tests.jointlab.runs.site import resume_run

SPEED = 200.0
# a channel without any noise is taken for a dead one
EXACT = BenchConditions(double_hits=0.0, scatter=0.0, gain_error=0.0, force_noise=1e-3, acceleration_noise=1e-4)
QUIET = Servo(cycle_noise=0.0, displacement_noise=0.0, force_noise=0.0)
SMALL: tuple[dict[str, Any], ...] = (
    {"step": "hammer", "points": ["5y", "7y", "1x"], "blows": 3, "block_seconds": 1.0},
    {"step": "wait", "seconds": 0.05},
    {
        "step": "sweep",
        "specimens": ["I"],
        "configurations": ["shear", "compression"],
        "amplitudes_pp_mm": [0.1, 0.05],
        "frequencies": {"first": 40, "last": 120, "step": 40},
        "order": "all",
        "seed": 5,
    },
)
PAUSE = 2.5  # s, longer than the tester's watchdog time
SAFE = (State.HYDRAULICS_OFF, State.TRIPPED)
PATIENCE = 60.0  # s that one child may take

# children are forked from a process that has everything imported, and neither threads nor connections
_children = multiprocessing.get_context("forkserver")
_children.set_forkserver_preload([__name__])


@dataclass(frozen=True)
class Job:
    """What a child is told: where the instruments and the catalogue are, and where to acknowledge."""

    sequence: dict[str, Any]
    addresses: Addresses
    database: str
    acknowledged: Path
    run_id: int | None


def measure(job: Job) -> None:
    """Run or resume in this process, and acknowledge every blow and sine point once the store has it."""
    acknowledged = os.open(job.acknowledged, os.O_WRONLY | os.O_CREAT | os.O_APPEND)

    def acknowledge(event: Event) -> None:
        match event:
            case BlowAccepted(point, blow) | BlowRefused(point, blow):
                os.write(acknowledged, f"{point} {blow}\n".encode())
            case SinePointMeasured(index=index):
                os.write(acknowledged, f"sine {index}\n".encode())

    operator = SimulatedOperator(OperatorClient(job.addresses.operator))
    instruments = instruments_of(simulated_settings(job.addresses))
    with Catalogue.open(job.database) as catalogue:
        if job.run_id is None:
            run_sequence(sequence_from(job.sequence), instruments, catalogue, operator, acknowledge, reset=True)
        else:
            resume_run(job.run_id, instruments, catalogue, operator, acknowledge, reset=True)


@dataclass
class Campaign:
    """One sequence that was carried out, with what became of it.

    Attributes:
        kills: how often its process was killed.
        acknowledged: every acknowledgement, in order.
        wrong: whatever is not as it has to be, in words; empty where all is well.
    """

    run: Run
    measurement: MeasuredArticle
    kills: int = 0
    resumed: int = 0
    resets: int = 0
    acknowledged: list[str] = field(default_factory=list)
    orphans: int = 0
    wrong: list[str] = field(default_factory=list)
    seconds: float = 0.0
    to_first: float = 0.0


def _stored(catalogue: Catalogue) -> Run | None:
    """The newest run, once all that a killed process left in spools is stored: it may have ended there."""
    store_spools(catalogue)
    return newest(catalogue)


class Site:
    """A deterministic laboratory and a folder; children measure there."""

    def __init__(self, laboratory: Laboratory, folder: Path, steps: Sequence[dict[str, Any]]) -> None:
        self.laboratory = laboratory
        self._folder = folder
        paper = named_sequence("paper").model_dump(mode="json")
        self.sequence = sequence_from(paper | {"steps": list(steps)}).model_dump(mode="json")
        self._count = 0

    def uninterrupted(self) -> Campaign:
        """Carry the sequence out in one go."""
        return self._campaign(random.Random(0), 0, 0.0)

    def killed(self, chance: random.Random, kills: int, longest: float) -> Campaign:
        """Carry the sequence out, killing its process after 0 to `longest` s up to `kills` times."""
        return self._campaign(chance, kills, longest)

    def _campaign(self, chance: random.Random, kills: int, longest: float) -> Campaign:
        self._count += 1
        database = f"sqlite:///{self._folder / f'{self._count}.db'}"
        acknowledged = self._folder / f"{self._count}.txt"
        done = killed = 0
        began, to_first = time.monotonic(), 0.0
        with Catalogue.open(database) as catalogue:
            while (run := _stored(catalogue)) is None or run.state is not RunState.FINISHED:
                job = Job(
                    self.sequence, self.laboratory.addresses, database, acknowledged, None if run is None else run.id
                )
                child = _children.Process(target=measure, args=(job,))
                child.start()
                if killed < kills:
                    child.join(chance.uniform(0.0, longest))
                    child.kill()
                elif kills == 0:
                    to_first = wait_for(acknowledged, began)
                child.join(PATIENCE)
                if child.exitcode == -signal.SIGKILL:
                    killed += 1
                    if chance.random() < 0.1:
                        time.sleep(PAUSE)  # until the tester has noticed
                elif child.exitcode != 0:
                    raise RuntimeError(f"a child ended with exit code {child.exitcode}; its error is above")
                done += 1
                if done > 10 * (kills + 3):
                    raise RuntimeError(f"{done} children have not finished the run")
            measurement = measurement_of_run(catalogue, run.id)
            lines = acknowledged.read_text(encoding="ascii").splitlines()
            found = Campaign(run, measurement, killed, acknowledged=lines, to_first=to_first)
            self._look(catalogue, found)
        found.seconds = time.monotonic() - began
        return found

    def _look(self, catalogue: Catalogue, found: Campaign) -> None:
        """Hold what is stored against the sequence and against what was acknowledged."""
        sequence, run = sequence_from(self.sequence), found.run
        with catalogue.reading() as session:
            blows, sines = list_blows(session, run.id), list_sine_records(session, run.id)
            events = list_run_events(session, run.id)
            rows = session.execute(
                text("SELECT specimen_id, configuration, commanded_pp_mm, frequency FROM sine_records")
            ).all()
        stored = Counter([f"{blow.point} {blow.number}" for blow in blows] + [f"sine {s.order_number}" for s in sines])
        twice = Counter(found.acknowledged)
        for what, wrong in (
            ("lost", [one for one in twice if one not in stored]),
            ("stored twice", [one for one, times in stored.items() if times > 1]),
            ("acknowledged twice", [one for one, times in twice.items() if times > 1]),
        ):
            if wrong:
                found.wrong.append(f"{what}: {', '.join(wrong)}")
        if sequence.sweep is None or len(set(rows)) != len(rows) or len(rows) != sequence.sweep.points:
            found.wrong.append(f"{len(rows)} sine points, {len(set(rows))} of them different")
        if [sine.order_number for sine in sorted(sines, key=lambda s: s.recorded_at or run.started_at)] != [
            *range(1, len(sines) + 1)
        ]:
            found.wrong.append("sine points were measured in another order than they are numbered")
        if any(later.elapsed <= earlier.elapsed for earlier, later in pairwise(sines)):
            found.wrong.append("the time of a sine point is not after that of the one before it")
        found.wrong += blows_wrong(sequence, blows)
        if events[-1].state is not RunState.FINISHED or events[0].state is not RunState.RUNNING:
            found.wrong.append(f"history from {events[0]} to {events[-1]}")
        found.resumed = sum(event.state is RunState.RUNNING for event in events) - 1
        found.resets = sum("tester reset after" in (event.reason or "") for event in events)
        found.orphans = len(catalogue.waveforms.records(run.waveform_file)) - len(blows) - len(sines)
        with run_lock(catalogue, run):  # nobody else does
            pass
        if not self._comes_to_rest():
            found.wrong.append("the actuator is not at rest")

    def _comes_to_rest(self) -> bool:
        """Whether the actuator is at rest once the tester has had time to notice that its client is gone."""
        end = time.monotonic() + PAUSE
        while not self._is_at_rest() and time.monotonic() < end:
            time.sleep(0.05)
        return self._is_at_rest()

    def _is_at_rest(self) -> bool:
        tester = self.laboratory.tester
        return tester.actuator.steady_pp() == 0.0 and tester.device.status()["state"] in SAFE


def blows_wrong(sequence: SequenceDocument, blows: Sequence[Any]) -> list[str]:
    """Whether every point has exactly the accepted blows asked for, numbered without a gap."""
    wrong = []
    for number, step in enumerate(sequence.hammer_steps, start=1):
        for point in step.points:
            struck = [blow for blow in blows if blow.set_number == number and str(blow.point) == point]
            accepted = sum(blow.accepted for blow in struck)
            if accepted != step.blows or [blow.number for blow in struck] != [*range(1, len(struck) + 1)]:
                wrong.append(f"{point} has {accepted} accepted blows, numbered {[blow.number for blow in struck]}")
    return wrong


def newest(catalogue: Catalogue) -> Run | None:
    """The run of a catalogue that has one at most."""
    with catalogue.reading() as session:
        return next((run for run in list_runs(session) if run.state is not RunState.CREATED), None)  # begun


def wait_for(acknowledged: Path, began: float) -> float:
    """Seconds from `began` until something is acknowledged."""
    while time.monotonic() < began + PATIENCE:
        with suppress(FileNotFoundError):
            if acknowledged.stat().st_size:
                break
        time.sleep(0.005)
    return time.monotonic() - began


def sine_errors(campaign: Campaign, dwells: Sequence[Dwell]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """(points,) |measured - true| / |true| of k + ih; true is the dwell of the amplitude that was recorded."""
    errors = []
    for point in campaign.measurement.points:
        same = (point.specimen, point.configuration, round(point.result.frequency))
        cycled = [d for d in dwells if (d.specimen, d.configuration, round(d.frequency)) == same]
        dwell = min(cycled, key=lambda d: abs(d.amplitude_pp - point.result.amplitude_pp))
        true = complex(dwell.stiffness, dwell.damping)
        errors.append(abs(point.result.complex_stiffness - true) / abs(true))
    return np.array(errors)


def sine_difference(one: Campaign, other: Campaign) -> float:
    """Largest relative difference of k + ih between two runs."""
    return max(
        abs(a.result.complex_stiffness - b.result.complex_stiffness) / abs(b.result.complex_stiffness)
        for a, b in zip(one.measurement.points, other.measurement.points, strict=True)
    )


def accelerance_difference(one: Campaign, other: Campaign) -> float:
    """Largest difference of accelerances between two runs over the largest accelerance of the same row."""
    differences = []
    for a, b in zip(one.measurement.sets, other.measurement.sets, strict=True):
        assert a.inputs == b.inputs
        largest = np.abs(b.accelerance).max(axis=-1, keepdims=True)
        differences.append(float(np.max(np.abs(a.accelerance - b.accelerance) / largest)))
    return max(differences)


@contextmanager
def deterministic_site(steps: Sequence[dict[str, Any]] = SMALL) -> Iterator[Site]:
    """A laboratory without noise or drift, an empty folder, and children that start at once."""
    first = _children.Process(target=os.getpid)  # waits until the process they are forked from has imported everything
    first.start()
    first.join()
    still = patch.object(SimulatedBench, "temperature", lambda bench, time: REFERENCE_TEMPERATURE)
    with still, Laboratory(9, SPEED, EXACT) as laboratory, tempfile.TemporaryDirectory() as folder:
        laboratory.tester.actuator.servo = QUIET
        yield Site(laboratory, Path(folder), steps)


def main(wanted: int = 120, kills_a_run: int = 10) -> None:
    """Kill until `wanted` processes were killed, and print what became of their runs."""
    with deterministic_site() as site:
        before, again = site.uninterrupted(), site.uninterrupted()
        chance, runs = random.Random(2026), list[Campaign]()
        while sum(run.kills for run in runs) < wanted:
            runs.append(site.killed(chance, kills_a_run, 2.0 * before.to_first))
        dwells = site.laboratory.tester.actuator.log
    show("child from start to its first acknowledged point", f"{before.to_first:.2f} s")
    show("runs, processes killed", f"{len(runs)}, {sum(run.kills for run in runs)}")
    show("resumed with a reset of the tripped tester", f"{sum(run.resets for run in runs)}")
    show("acknowledged points", f"{sum(len(run.acknowledged) for run in runs)}")
    wrong = [word for run in [before, again, *runs] for word in run.wrong]
    show("lost, doubled, out of order, or otherwise wrong", f"{len(wrong)} {wrong or ''}")
    show("records cut off before their row (never acknowledged)", f"{sum(run.orphans for run in runs)}")
    for name, some in (("uninterrupted", [before, again]), ("killed", runs)):
        worst = max(float(sine_errors(run, dwells).max()) for run in some)
        show(f"k + ih against the bench's own, {name}", f"within {100 * worst:.4f} %")
    show("k + ih, two uninterrupted runs", f"within {100 * sine_difference(again, before):.3f} %")
    show("k + ih, killed against uninterrupted", f"within {100 * max(sine_difference(r, before) for r in runs):.3f} %")
    show(
        "accelerance over its peak, two uninterrupted runs",
        f"within {100 * accelerance_difference(again, before):.3f} %",
    )
    killed = max(accelerance_difference(run, before) for run in runs)
    show("accelerance over its peak, killed against uninterrupted", f"within {100 * killed:.3f} %")


def show(what: str, figure: str) -> None:
    """Print a line of the table."""
    print(f"{what:<60} {figure}", flush=True)
