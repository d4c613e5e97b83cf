"""Kills of the drive process, the service, the database and workers while a sweep moves: at rest in time, nothing lost.

Each kill befalls a run that measures. Where the drive process was killed, the actuator has to be at rest within the
watchdog time of the tester and one tick. Then the run goes on, and at its end every sine point that the sequence asks
for has to be in the catalogue, once.

`KILLS` in the environment is the number of kills in all, 40 by default; a full run has 500.
"""

import os
import signal
import tempfile
import time
from collections import Counter
from contextlib import ExitStack, suppress
from pathlib import Path
from subprocess import Popen

import numpy as np

from jointlab.client import Client, Driver, ProblemError
from rig.registers import State
from rig.tester_monitor import poll_tester
from simlab.laboratory import LaboratoryProcess
from simlab.tester_device import DeviceLimits
from store.catalogue import Catalogue
from store.check import check
from store.sine_records import list_sine_records
from store.states import RunState
from tests.api.conftest import configuration, paper
from tests.bench.bench_stop import service_process, wait
from tests.drive_holder import drive_process
from tests.postgresql_server import NotInstalledError, Server, running_server

KILLS = int(os.environ.get("KILLS", "40"))
POINTS = 40
TICK = 0.1  # s, of a bench that looks by polling beside the tester's own clock
SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [0.1],
    "frequencies": {"first": 20, "last": 20 + 4 * (POINTS - 1), "step": 4},
}  # fmt: skip
MOVING = frozenset({State.RAMPING, State.CYCLING, State.SETTLED})


class Bench:
    """The processes, and what has been counted."""

    def __init__(self, folder: Path, laboratory: LaboratoryProcess, database: Server | None) -> None:
        self.folder = folder
        self.laboratory = laboratory
        self.database = database
        self.url = f"sqlite:///{folder / 'jointlab.db'}" if database is None else database.url("postgres")
        self.config = folder / "jointlab.toml"
        self.config.write_text(configuration(laboratory.addresses, folder), encoding="utf-8")
        self.rests = list[float]()
        self._held = ExitStack()
        self.service, self.address = self._serve()

    def _serve(self) -> tuple[Popen[str], str]:
        return self._held.enter_context(service_process(self.config, self.url, self.folder / "service.log"))

    def kill(self, what: str) -> None:
        """Kill a process of this kind while the actuator moves, and see to it that the others are there again."""
        if what == "drive process":
            os.kill(drive_process(self.folder), signal.SIGKILL)
            self.rests.append(self._rest())
        elif what == "service":
            self.service.kill()
            self.service.wait()
            self.service, self.address = self._serve()
        elif what == "database" and self.database is not None:
            with self.database.connect() as connection:
                serving = (
                    "SELECT pid FROM pg_stat_activity WHERE backend_type = 'client backend' AND pid <> pg_backend_pid()"
                )
                for (process,) in connection.execute(serving).fetchmany(1):
                    os.kill(int(str(process)), signal.SIGKILL)  # then the server recovers as after a crash
        elif what == "workers":
            children = Path(f"/proc/{self.service.pid}/task/{self.service.pid}/children").read_text().split()
            for child in map(int, children):
                if child != drive_process(self.folder):
                    with suppress(ProcessLookupError):
                        os.kill(child, signal.SIGKILL)

    def _rest(self) -> float:
        """Seconds until the tester reports that nothing moves."""
        began = time.monotonic()
        while poll_tester(self.laboratory.addresses.tester).state in MOVING:
            time.sleep(0.005)
        return time.monotonic() - began

    def close(self) -> None:
        with suppress(ProcessLookupError):
            os.kill(drive_process(self.folder), signal.SIGTERM)
        self._held.close()


def measure(bench: Bench, lab: Client, kinds: list[str], chance: np.random.Generator) -> tuple[int, int]:
    """Measure one run, with a kill of each of `kinds` on the way; the points lost and the points stored twice."""
    run = lab.create_run(paper() | {"steps": [SWEEP]}).id
    begun = False
    while True:
        with (
            suppress(ProblemError),
            Client(bench.address) as client,
            client.driving("bench", by_force=True) as driver,
        ):
            begun = go_on(bench, client, driver, run, begun)
            while kinds and client.rig().phase != "idle":
                time.sleep(float(chance.uniform(0.05, 0.6)))
                if poll_tester(bench.laboratory.addresses.tester).state in MOVING:
                    bench.kill(kinds.pop())
            if not kinds and client.wait_for_run(run).state is RunState.FINISHED:
                break
    with Catalogue.open(bench.url, bench.folder / "jointlab-waveforms") as catalogue:
        with catalogue.reading() as session:
            counts = Counter(record.order_number for record in list_sine_records(session, run))
        damaged = [finding for finding in check(catalogue) if finding.damage]
    assert not damaged, damaged
    return len(set(range(1, POINTS + 1)) - set(counts)), sum(count - 1 for count in counts.values())


def go_on(bench: Bench, lab: Client, driver: Driver, run: int, begun: bool) -> bool:
    """Begin the run, or go on with it where it is not carried out; mount what is asked for."""
    state = lab.rig()
    if state.interlocks:
        driver.acknowledge_interlock(run, "the bench killed the drive process")
    if state.phase == "idle":
        if begun and lab.run(run).state is not RunState.FINISHED:
            driver.resume(run)
        elif not begun:
            driver.start(run)
    with suppress(TimeoutError):
        wait(lambda: lab.rig().prompt is not None or lab.rig().sines > 0 or lab.rig().phase == "idle")
    if (prompt := lab.rig().prompt) is not None:
        bench.laboratory.operator.do("mount", specimen="I", configuration="shear")
        driver.answer(run, prompt.number)
    return True


def main() -> None:
    """Kill while runs measure; print how long the actuator moved on, and what was lost or stored twice."""
    chance, lost, twice, killed = np.random.default_rng(5), 0, 0, Counter[str]()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="kills-")))
        laboratory = stack.enter_context(LaboratoryProcess(seed=1, speed=20.0))
        database = None
        with suppress(NotInstalledError):
            database = stack.enter_context(running_server())
        bench = Bench(folder, laboratory, database)
        stack.callback(bench.close)
        kinds = ("drive process", "service", "workers", *(("database",) if database is not None else ()))
        left = [kinds[number % len(kinds)] for number in range(KILLS)]
        chance.shuffle(left)
        while left:
            now, left = left[:3], left[3:]
            killed.update(now)
            with Client(bench.address) as lab:
                missing, repeated = measure(bench, lab, now, chance)
            lost, twice = lost + missing, twice + repeated
            print(f"{sum(killed.values())} kills: {lost} points lost, {twice} stored twice", flush=True)
    allowed = DeviceLimits().watchdog_time + TICK
    late = [rest for rest in bench.rests if rest > allowed]
    print(", ".join(f"{what} {count}" for what, count in killed.items()))
    print(
        f"at rest within {allowed:g} s of a kill of the drive process: {len(bench.rests) - len(late)} of "
        f"{len(bench.rests)}, the longest {max(bench.rests, default=0.0):.2f} s; records {lost} lost, {twice} twice"
    )
