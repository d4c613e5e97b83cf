"""Kills of the drive process, the service, the database and workers while a sweep moves: at rest in time, nothing lost.

Each kill comes while the actuator moves, by the record of the simulated instrument. That record says as well when the
actuator was at rest, and for how long it has moved without a heartbeat at most, whatever was killed. The run goes on
then; at its end every sine point that the sequence asks for has to be in the catalogue, once. A point that was
measured again was not lost, but interrupted: the log of the instrument has at most one of them for each kill of a
drive process.

`KILLS` in the environment is the number of kills in all, 40 by default; a full run has 500. `LABORATORIES` work side by
side, two by default, each with a database, a service and a drive process of its own.
"""

import os
import signal
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass, field
from http import HTTPStatus
from itertools import pairwise
from pathlib import Path
from subprocess import Popen

import numpy as np

from jointlab.client import Client, Driver, ProblemError
from jointlab.client.connection import Connection
from jointlab.drive.process import SPOOLS
from rig.runs.spool import spools
from simlab.laboratory import LaboratoryProcess
from simlab.tester_device import DeviceLimits
from store.backup.check import check
from store.catalogue import Catalogue
from store.measurements.runs import list_runs
from store.measurements.sine_records import list_sine_records
from store.service.jobs import list_jobs
from store.states import JobState, RunState
from tests.api.conftest import configuration, paper
from tests.bench.bench_stop import service_process, wait
from tests.drive_holder import drive_process
from tests.postgresql_server import NotInstalledError, Server, running_server

KILLS = int(os.environ.get("KILLS", "40"))
LABORATORIES = int(os.environ.get("LABORATORIES", "2"))
SPEED = 20.0
POINTS = 60
TICK = 0.1  # s
INTERRUPTED = 30.0  # s on the bench, more than one amplitude of a point takes, less than the watchdog lets pass
PATIENCE = 120.0  # s that one step of a run may take
DRIVE, SERVICE, WORKER, DATABASE = "drive process", "service", "worker", "database"
SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [0.1],
    "frequencies": {"first": 20, "last": 20 + 3 * (POINTS - 1), "step": 3},
}  # fmt: skip


@dataclass
class Counts:
    """What has been counted.

    Attributes:
        kills: by what was killed.
        rests: s from the kill of a drive process to rest.
        unheard: s that an actuator has moved without a heartbeat, at most.
        lost, twice: sine points.
        repeated: sine points that were measured again.
        given_up: jobs that failed because their workers were killed too often.
        left: what nobody has stored, begun or ended, spools, runs and jobs; and what is damaged.
    """

    kills: Counter[str] = field(default_factory=Counter)
    rests: list[float] = field(default_factory=list)
    unheard: float = 0.0
    lost: int = 0
    twice: int = 0
    repeated: int = 0
    given_up: int = 0
    left: list[str] = field(default_factory=list)


class Bench:
    """One laboratory and the processes around it."""

    def __init__(self, folder: Path, laboratory: LaboratoryProcess, database: Server | None) -> None:
        self.folder = folder
        self.laboratory = laboratory
        self.database = database
        self.url = f"sqlite:///{folder / 'jointlab.db'}" if database is None else database.url("postgres")
        self.config = folder / "jointlab.toml"
        self.config.write_text(configuration(laboratory.addresses, folder), encoding="utf-8")
        self.counts = Counts()
        self.dwells = 0
        self._held = ExitStack()
        self.service, self.address = self._serve()

    def _serve(self) -> tuple[Popen[str], str]:
        return self._held.enter_context(service_process(self.config, self.url, self.folder / "service.log"))

    def serve_again(self) -> None:
        """Start a service in place of one that was killed."""
        self.service, self.address = self._serve()

    def catalogue(self) -> Catalogue:
        return Catalogue.open(self.url, self.folder / "jointlab-waveforms")

    def motion(self) -> dict[str, float | None]:
        found: dict[str, float | None] = self.laboratory.operator.do("motion")
        return found

    def is_moving(self) -> bool:
        rest = self.motion()["rests_since"]
        return rest is None or rest > time.monotonic()

    def kill(self, what: str, run: int) -> None:
        """Kill a process of this kind while the actuator moves."""
        if what == DRIVE:
            began = time.monotonic()
            os.kill(drive_process(self.folder), signal.SIGKILL)
            wait(lambda: not self.is_moving())
            rest = self.motion()["rests_since"]
            assert rest is not None
            self.counts.rests.append(max(rest - began, 0.0))
        elif what == SERVICE:
            self.service.kill()
            self.service.wait()
            self.serve_again()
        elif what == DATABASE and self.database is not None:
            with self.database.connect() as connection:
                serving = (
                    "SELECT pid FROM pg_stat_activity WHERE backend_type = 'client backend' AND pid <> pg_backend_pid()"
                )
                for (process,) in connection.execute(serving).fetchmany(1):
                    os.kill(int(str(process)), signal.SIGKILL)  # then the server recovers as after a crash
        elif what == WORKER:
            with closing(Connection(self.address, None, PATIENCE)) as service:
                try:
                    service.request("POST", "/exports", body={"run": run, "form": "hdf5"})
                except ProblemError as problem:
                    if problem.status != HTTPStatus.CONFLICT:  # the export of this run whose worker was killed goes on
                        raise
            wait(lambda: bool(self.workers()))
            for worker in self.workers():
                with suppress(ProcessLookupError):
                    os.kill(worker, signal.SIGKILL)
        self.counts.kills[what] += 1

    def workers(self) -> list[int]:
        """Processes of jobs: those that the server of forks, a child of the service, has made."""
        drive = drive_process(self.folder)
        return [each for child in _children(self.service.pid) if child != drive for each in _children(child)]

    def close(self) -> None:
        with suppress(ProcessLookupError):
            os.kill(drive_process(self.folder), signal.SIGTERM)
        self._held.close()


def _children(process: int) -> list[int]:
    """Children of all threads of a process; none where it has gone."""
    with suppress(FileNotFoundError, ProcessLookupError):
        threads = Path(f"/proc/{process}/task").iterdir()
        return [int(child) for thread in threads for child in (thread / "children").read_text().split()]
    return []


def measure(bench: Bench, kinds: list[str], chance: np.random.Generator) -> None:
    """Measure one run, with kills of `kinds` on the way, and look at what came of it."""
    with Client(bench.address) as lab:
        run = lab.create_run(paper() | {"steps": [SWEEP]}).id
    drives = bench.counts.kills[DRIVE]
    end = time.monotonic() + PATIENCE
    while True:
        try:
            with Client(bench.address) as lab, lab.driving("bench", by_force=True) as driver:
                while not (moves := go_on(bench, lab, driver, run)) and lab.run(run).state is not RunState.FINISHED:
                    if time.monotonic() > end:
                        raise TimeoutError(f"run {run} does not go on: {lab.rig()}")
                    time.sleep(0.05)
        except ProblemError as problem:
            if time.monotonic() > end:
                raise TimeoutError(f"run {run} does not go on: {problem}") from problem
            time.sleep(0.1)
            continue
        if not moves:
            break
        end = time.monotonic() + PATIENCE
        time.sleep(float(chance.uniform(0.0, 0.4)))
        if kinds and bench.is_moving():
            bench.kill(kinds.pop(), run)
    look(bench, run, bench.counts.kills[DRIVE] - drives)


def go_on(bench: Bench, lab: Client, driver: Driver, run: int) -> bool:
    """Do what the run needs to begin or go on, and whether it moves."""
    state = lab.rig()
    if state.phase == "idle":
        known = lab.run(run).state
        if state.interlocks:
            driver.acknowledge_interlock(run, "the bench killed the drive process")
        if known is RunState.CREATED:
            driver.start(run)
        elif known is not RunState.FINISHED:
            driver.resume(run)
    elif state.prompt is not None:
        bench.laboratory.operator.do("mount", specimen="I", configuration="shear")
        driver.answer(run, state.prompt.number)
    else:
        return state.sines < POINTS and bench.is_moving()
    return False


def look(bench: Bench, run: int, drives: int) -> None:
    """Count what was lost, stored twice, measured again or left behind by a run that is finished."""
    counts = bench.counts
    unheard = bench.motion()["longest_unheard"]
    assert unheard is not None
    counts.unheard = max(counts.unheard, unheard)
    with bench.catalogue() as catalogue, catalogue.reading() as session:
        stored = Counter(record.order_number for record in list_sine_records(session, run))
    counts.lost += len(set(range(1, POINTS + 1)) - set(stored))
    counts.twice += sum(count - 1 for count in stored.values())
    dwells = bench.laboratory.operator.do("dwells")[bench.dwells :]
    bench.dwells += len(dwells)
    repeated = visits(dwells) - POINTS
    counts.repeated += repeated
    if repeated > drives:
        raise AssertionError(f"{repeated} points of run {run} were measured again after {drives} kills of its process")


def visits(dwells: Sequence[dict[str, float]]) -> int:
    """How many sine points the log of the instrument has; one may take several dwells in a row."""
    return 1 + sum(
        later["frequency"] != dwell["frequency"] or later["start"] - dwell["start"] > INTERRUPTED
        for dwell, later in pairwise(dwells)
    )


def remains(bench: Bench) -> list[str]:
    """What nobody has stored, begun or ended, after a last look of everybody; and what is damaged."""
    with bench.catalogue() as catalogue:
        with suppress(TimeoutError):
            wait(lambda: not _open(bench, catalogue))
        return _open(bench, catalogue) + [str(finding) for finding in check(catalogue) if finding.damage]


def _open(bench: Bench, catalogue: Catalogue) -> list[str]:
    with catalogue.reading() as session:
        jobs, runs = list_jobs(session, limit=1000), list_runs(session, limit=1000)
    given_up = [job for job in jobs if job.state is JobState.FAILED and (job.error or "").startswith("given up after")]
    bench.counts.given_up = len(given_up)
    return [
        *(
            f"job {job.id}: {job.state}, {job.error}"
            for job in jobs
            if job.state is not JobState.DONE and job not in given_up
        ),
        *(f"run {run.id}: {run.state}" for run in runs if run.state is not RunState.FINISHED),
        *map(str, spools(bench.folder / "drive" / SPOOLS)),
    ]


@contextmanager
def benched(number: int, speed: float = SPEED) -> Iterator[Bench]:
    """One laboratory with its database, its service and its drive process."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix=f"kills-{number}-")))
        laboratory = stack.enter_context(LaboratoryProcess(seed=number, speed=speed))
        database = None
        with suppress(NotInstalledError):
            database = stack.enter_context(running_server(durable=True))
        bench = Bench(folder, laboratory, database)
        stack.callback(bench.close)
        yield bench


def kill_in(number: int, kills: int) -> Counts:
    """Kill in one laboratory, run after run, and print how far it has come."""
    chance = np.random.default_rng(number)
    with benched(number) as bench:
        kinds = (DRIVE, SERVICE, WORKER, *((DATABASE,) if bench.database is not None else ()))
        left = [kinds[each % len(kinds)] for each in range(kills)]
        chance.shuffle(left)
        counts = bench.counts
        began = time.monotonic()
        while left:
            measure(bench, left, chance)
            print(
                f"laboratory {number}, {time.monotonic() - began:5.0f} s: {counts.kills.total()} kills, "
                f"{counts.lost} points lost, {counts.twice} twice, {counts.repeated} measured again",
                flush=True,
            )
        counts.left = remains(bench)
    return counts


def main() -> None:
    """Kill while runs measure; print how long the actuators moved on, and what was lost or stored twice."""
    with ThreadPoolExecutor(LABORATORIES) as working:
        share = -(-KILLS // LABORATORIES)
        found = list(working.map(lambda number: kill_in(number, share), range(1, LABORATORIES + 1)))
    allowed = DeviceLimits().watchdog_time + TICK
    rests = [rest for each in found for rest in each.rests]
    kills = sum((each.kills for each in found), Counter[str]())
    print(f"{kills.total()} kills:", ", ".join(f"{what} {count}" for what, count in kills.items()))
    print(
        f"at rest within {allowed:g} s of a kill of the drive process: {sum(rest <= allowed for rest in rests)} of "
        f"{len(rests)}, the longest {max(rests, default=0.0):.3f} s"
    )
    print(f"longest motion without a heartbeat, whatever was killed: {max(each.unheard for each in found):.3f} s")
    print(
        f"sine points: {sum(each.lost for each in found)} lost, {sum(each.twice for each in found)} stored twice, "
        f"{sum(each.repeated for each in found)} interrupted and measured again; "
        f"{sum(each.given_up for each in found)} jobs given up after kills of their workers"
    )
    print("left:", *([what for each in found for what in each.left] or ["nothing"]), sep="\n  ")
