"""A rig that works for hours, with campaigns, faults and clients: what grows, and by how much an hour (`make soak`).

Runs of sine points follow one another at speed 50. Every 20 s one of three faults comes, drawn with a fixed seed: STOP,
the line to the tester cut, or one that loses every reply; it is repaired, the tester is reset, and the run goes on.
Four clients read state, runs, health and the page; the latest run that has ended is identified again and again by a
worker.

Each process is looked at every 5 s: its memory, descriptors and threads; how long the service takes to say the state of
the rig (median between two looks), and the size of the files. Slopes are those of the second half, with standard errors
(`slopes.py`): in the first half caches fill, and the journals of drive process and service, which keep 5,000 events.
Files of measurements have to grow; their slope is shown for each 1,000 sine points.

`HOURS` in the environment is the duration, 0.05 by default.
"""

import os
import random
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

import httpx
import numpy as np

from jointlab.client import Client, Driver, ProblemError
from simlab.laboratory import LaboratoryProcess
from tests.api.conftest import configuration, paper
from tests.bench.bench_stop import service_process
from tests.bench.slopes import slope_of
from tests.drive_holder import drive_process, end_drive_process
from tests.fault_proxy import FaultProxy, Impairment, Way
from tests.jointlab.jobs.conftest import start_scheduler

HOURS = float(os.environ.get("HOURS", "0.05"))
SPEED = 50.0
INTERVAL = 5.0  # s between two looks
FAULTS_EVERY = 20.0  # s
FAULT_LASTS = 4.0  # s, of a line: longer than a run takes to end
WARM_UP = 0.5  # of the duration
SEED = 1
SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [0.1, 0.05],
    "frequencies": {"first": 20, "last": 200, "step": 10}, "order": "sequential",
}  # fmt: skip
READS = ("/api/rig", "/api/runs", "/api/health/ready", "/page/")
RESIDENT, OWN = re.compile(r"^Rss:\s+(\d+)", re.M), re.compile(r"^Private_\w+:\s+(\d+)", re.M)


@dataclass
class Series:
    """Values of one thing over time; `unit` is that of a value."""

    unit: str
    seconds: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)


@dataclass
class Counts:
    """What was done: sine points, runs that were begun, faults by name, reads of clients and failed ones, jobs."""

    points: int = 0
    runs: int = 0
    faults: dict[str, int] = field(default_factory=dict)
    reads: int = 0
    refused: int = 0
    jobs: int = 0


class Soak:
    """The campaign, its faults and the looks at everything. One thread calls it."""

    def __init__(
        self, lab: Client, driver: Driver, laboratory: LaboratoryProcess, line: FaultProxy, counts: Counts
    ) -> None:
        self._lab, self._driver, self._laboratory, self._line = lab, driver, laboratory, line
        self._counts = counts
        self._random = random.Random(SEED)
        self._sines = 0
        self._latest_done: int | None = None
        self._job: int | None = None
        self._latencies = list[float]()
        self._run: int | None = None

    def step(self) -> None:
        """Do what the rig needs to measure on."""
        began = time.monotonic()
        state = self._lab.rig()
        self._latencies.append(time.monotonic() - began)
        self._counts.points += max(state.sines - self._sines, 0)
        self._sines = state.sines
        with suppress(ProblemError):  # as the line is bad, or the run has just ended: it is tried at the next step
            if state.stop is not None:
                self._driver.reset_stop()
            elif state.phase == "idle" and state.tripped and self._run is not None:
                self._driver.acknowledge_interlock(self._run, "the soak made it trip")
            elif state.phase == "idle" and state.ended_as in ("failed", "stopped") and self._run is not None:
                self._driver.resume(self._run)
            elif state.phase == "idle":
                self._latest_done = self._run
                self._run = self._lab.create_run(paper() | {"steps": [SWEEP]}).id
                self._driver.start(self._run)
                self._counts.runs += 1
            elif state.prompt is not None and state.prompt.waits and state.run_id is not None:
                self._laboratory.operator.do("mount", specimen="I", configuration="shear")
                self._driver.answer(state.run_id, state.prompt.number)

    def fault(self) -> None:
        """Let something go wrong, and repair it."""
        kind = self._random.choice(("STOP", "line cut", "replies lost"))
        self._counts.faults[kind] = self._counts.faults.get(kind, 0) + 1
        if kind == "STOP":
            with suppress(ProblemError):  # where the tester has not answered yet
                self._lab.stop()
            return
        if kind == "line cut":
            self._line.cut()
        else:
            self._line.impair(Impairment(lost=Way.REPLIES))
        time.sleep(FAULT_LASTS)
        self._line.repair()

    def identify(self) -> None:
        """Let a worker identify the latest run, if it is not at work."""
        if self._latest_done is None:
            return
        if self._job is None or self._lab.job(self._job).state in ("done", "failed"):
            self._counts.jobs += self._job is not None
            self._job = self._lab.identify(self._latest_done).id

    def latency(self) -> float:
        """Median time that the state of the rig took since the last call, ms."""
        found, self._latencies = 1e3 * median(self._latencies), []
        return found


def memory(process: int) -> tuple[float, float]:
    """Resident memory of a process, and what of it is its own, MB."""
    text = Path(f"/proc/{process}/smaps_rollup").read_text()
    return tuple(sum(map(int, kind.findall(text))) / 1e3 for kind in (RESIDENT, OWN))  # type: ignore[return-value]  # two


def process_values(process: int) -> dict[str, tuple[float, str]]:
    """Memory, descriptors and threads of a process, each with its unit; empty where it has ended."""
    place = Path(f"/proc/{process}")
    try:
        resident, own = memory(process)
        descriptors, threads = len(list((place / "fd").iterdir())), len(list((place / "task").iterdir()))
    except (FileNotFoundError, ProcessLookupError):
        return {}
    return {
        "resident memory": (resident, "MB"), "memory of its own": (own, "MB"),
        "descriptors": (float(descriptors), "1"), "threads": (float(threads), "1"),
    }  # fmt: skip


def size_of(*paths: Path) -> float:
    """Size of files and of all in folders, MB."""
    files = [each for path in paths for each in (path, *path.rglob("*"))]
    found = 0
    for each in files:
        with suppress(FileNotFoundError):  # removed meanwhile
            found += each.stat().st_size if each.is_file() else 0
    return found / 1e6


def files_of(folder: Path) -> dict[str, float]:
    """Sizes by kind, MB."""
    return {
        "measurements (database, waveforms)": size_of(*folder.glob("jointlab.db*"), folder / "jointlab-waveforms"),
        "spools": size_of(folder / "drive" / "spools"),
        "logs": size_of(*folder.glob("*.log"), *(folder / "drive").glob("drive.*")),
    }


@contextmanager
def reading(address: str, counts: Counts) -> Iterator[None]:
    """Clients that read, one thread each, while the context lasts."""
    over = threading.Event()

    def read(path: str) -> None:
        with httpx.Client(base_url=address, timeout=30.0) as client:
            while not over.wait(0.5):
                counts.refused += client.get(path).status_code >= 400
                counts.reads += 1

    threads = [threading.Thread(target=read, args=(path,)) for path in READS]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        over.set()
        for thread in threads:
            thread.join()


@contextmanager
def worker_process(scheduler: str, config: Path, database: str, output: Path) -> Iterator[int]:
    """`jointlab worker` in a process of its own, and its number."""
    environment = os.environ | {
        "JOINTLAB_DATABASE_URL": database, "JOINTLAB_CONFIG": str(config),
        "JOINTLAB_WAVEFORM_FOLDER": str(config.with_name("jointlab-waveforms")),
    }  # fmt: skip
    with output.open("a") as log:
        command = [sys.executable, "-m", "api.cli", "worker", scheduler]
        process = subprocess.Popen(command, env=environment, stdout=log, stderr=log)
        try:
            yield process.pid
        finally:
            process.terminate()
            process.wait()


def line_of(name: str, what: str, series: Series, per: float = 1.0, unit: str = "h") -> str:
    """A line of the table."""
    seconds, values = np.array(series.seconds), np.array(series.values)
    warm = seconds >= WARM_UP * seconds[-1]
    if np.count_nonzero(warm) < 3:
        return f"{name:<21}{what:<36}{values[0]:9.2f}{values[-1]:9.2f}  too short for a slope"
    slope = slope_of(seconds[warm], values[warm])
    return (
        f"{name:<21}{what:<36}{values[0]:9.2f}{values[-1]:9.2f}{slope.value / per:11.3f} +- {slope.error / per:<9.3f}"
        f"{series.unit}/{unit}"
    )


def main() -> None:
    """Work for so many hours; print what grew."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="soak-")))
        laboratory = stack.enter_context(LaboratoryProcess(seed=SEED, speed=SPEED))
        tester = laboratory.addresses.tester.removeprefix("tcp://")
        line = FaultProxy(tester, SEED)
        stack.callback(line.stop)
        config = folder / "jointlab.toml"
        text = configuration(laboratory.addresses, folder).replace(f"tcp://{tester}", f"tcp://{line.address}")
        config.write_text(text, encoding="utf-8")
        database = f"sqlite:///{folder / 'jointlab.db'}"
        os.environ["DASK_LOGGING__DISTRIBUTED"] = "error"  # to this and the worker: the table is what is to be read
        scheduling, scheduler = start_scheduler()
        stack.callback(scheduling.wait)
        stack.callback(scheduling.terminate)
        os.environ["JOINTLAB_SCHEDULER"] = scheduler
        stack.callback(os.environ.pop, "JOINTLAB_SCHEDULER")
        stack.callback(end_drive_process, folder)
        service, address = stack.enter_context(service_process(config, database, folder / "service.log"))
        worker = stack.enter_context(worker_process(scheduler, config, database, folder / "worker.log"))
        processes = {
            "drive process": drive_process(folder), "service": service.pid, "worker": worker,
            "simulated laboratory": laboratory.process,
        }  # fmt: skip
        counts, seen = Counts(), dict[tuple[str, str], Series]()
        lab = stack.enter_context(Client(address))
        driver = stack.enter_context(lab.driving("soak"))
        stack.enter_context(reading(address, counts))
        soak = Soak(lab, driver, laboratory, line, counts)
        began = looked = faulted = time.monotonic()

        def note(name: str, what: str, value: float, unit: str) -> None:
            series = seen.setdefault((name, what), Series(unit))
            series.seconds.append(time.monotonic() - began)
            series.values.append(value)

        while time.monotonic() - began < 3600.0 * HOURS:
            soak.step()
            soak.identify()
            if time.monotonic() - faulted >= FAULTS_EVERY:
                soak.fault()
                faulted = time.monotonic()
            if time.monotonic() - looked >= INTERVAL:
                looked = time.monotonic()
                for name, process in processes.items():
                    for what, (value, unit) in process_values(process).items():
                        note(name, what, value, unit)
                note("service", "time to answer", soak.latency(), "ms")
                for what, size in files_of(folder).items():
                    note("files", what, size, "MB")
                note("sine points", "", counts.points / 1e3, "1000")
            time.sleep(0.2)
        with suppress(ProblemError):
            lab.stop()
    points = seen.pop(("sine points", ""))
    seconds, values = np.array(points.seconds), np.array(points.values)
    warm = seconds >= WARM_UP * seconds[-1]
    pace = slope_of(seconds[warm], values[warm]).value if np.count_nonzero(warm) >= 3 else 0.0
    print(
        f"{HOURS:g} h at speed {SPEED:g}: {counts.points} sine points in {counts.runs} runs, {counts.jobs} jobs, "
        f"{counts.reads} reads ({counts.refused} refused), faults {counts.faults}"
    )
    print(f"{'':<21}{'':<36}{'at first':>9}{'at last':>9}{'slope':>11}    standard error")
    for (name, what), series in seen.items():
        grows = what.startswith("measurements") and pace > 0.0
        print(line_of(name, what, series, pace if grows else 1.0, "1000 points" if grows else "h"), flush=True)
