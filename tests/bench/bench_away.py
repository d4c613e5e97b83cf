"""A rig that is cut off from its service and its database for a day, in the middle of a sweep: nothing lost or twice.

The sweep begins with everybody there. Then the service is killed, and the database accepts and answers nothing; the
drive process works on alone, as `when_alone` is "finish" by default, and keeps what it measures on its own disk. At the
end the database answers again, a new service starts and stores what has come, while the sweep goes on. The sweep is
stopped some points later. Every sine point that the log of the simulated instrument has must then be in the catalogue,
once, and its record undamaged.

`HOURS` in the environment is the time away on the bench, 0.5 by default; the bench works at speed 50, so that a day
takes 29 minutes.
"""

import os
import signal
import time
from collections import Counter
from pathlib import Path

from jointlab.client import Client
from jointlab.drive.process import SPOOLS
from store.backup.check import check
from store.measurements.sine_records import list_sine_records
from tests.api.conftest import paper
from tests.bench.bench_kills import Bench, benched, visits
from tests.bench.bench_stop import wait

HOURS = float(os.environ.get("HOURS", "0.5"))
SPEED = 50.0
AROUND = 50
"""Sine points that are measured before everybody goes, and after they are back."""
SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"],
    "amplitudes_pp_mm": [0.1, 0.08, 0.06, 0.05, 0.04, 0.03, 0.02, 0.01],
    "frequencies": {"first": 20, "last": 200, "step": 0.02},
    "mains_frequency": None,
}  # fmt: skip
"""More points than a day has time for; none is moved beside the mains, where several would have one frequency."""


def main() -> None:
    """Cut a rig off, let it come back, and print what became of its records."""
    with benched(1, SPEED) as bench:
        with Client(bench.address) as lab:
            run = lab.create_run(paper() | {"steps": [SWEEP]}).id
            with lab.driving("bench") as driver:
                driver.start(run)
                wait(lambda: lab.rig().prompt is not None)
                prompt = lab.rig().prompt
                assert prompt is not None
                bench.laboratory.operator.do("mount", specimen="I", configuration="shear")
                driver.answer(run, prompt.number)
            wait(lambda: lab.rig().sines >= AROUND)
        before = len(bench.laboratory.operator.do("dwells"))
        _cut_off(bench)
        time.sleep(HOURS * 3600 / SPEED)
        spooled, alone = _spooled(bench.folder), len(bench.laboratory.operator.do("dwells")) - before
        if bench.database is not None:
            bench.database.send(signal.SIGCONT)
        returned = time.monotonic()
        bench.serve_again()
        with Client(bench.address) as lab:
            known = lab.rig().sines
            wait(lambda: lab.rig().sines >= known + AROUND or lab.rig().reason is not None)
            going = "goes on" if lab.rig().reason is None else "HAS ENDED"
            lab.stop()
        database = "frozen" if bench.database else "in a file"
        print(f"away for {HOURS:g} h of the bench, with the database {database}; then the sweep {going}")
        print(f"{alone} sine points were measured meanwhile, {spooled / 1e6:.0f} MB on the disk of the rig")
        _look(bench, run, returned)
        with Client(bench.address) as lab:
            ended = lab.run(run)
            print(f"the run is {ended.state}: {ended.reason}")


def _cut_off(bench: Bench) -> None:
    bench.service.kill()
    bench.service.wait()
    if bench.database is not None:
        bench.database.send(signal.SIGSTOP)


def _spooled(folder: Path) -> int:
    return sum(each.stat().st_size for each in (folder / "drive" / SPOOLS).rglob("*") if each.is_file())


def _look(bench: Bench, run: int, returned: float) -> None:
    """Wait until everything is stored, and compare it with what the instrument has done."""
    end = time.monotonic() + 1800.0
    while _spooled(bench.folder) and time.monotonic() < end:
        time.sleep(0.5)
    stored_after = time.monotonic() - returned
    measured, unheard = visits(bench.laboratory.operator.do("dwells")), bench.motion()["longest_unheard"]
    with bench.catalogue() as catalogue:
        with catalogue.reading() as session:
            stored = Counter(record.order_number for record in list_sine_records(session, run))
        damaged = [str(finding) for finding in check(catalogue) if finding.damage]
    last = max(stored)
    lost, twice = set(range(1, last + 1)) - set(stored), stored.total() - len(stored)
    print(
        f"all stored {stored_after:.0f} s after the return: {last} sine points of {measured} that the instrument began;"
    )
    print(f"{len(lost)} lost, {twice} twice, {len(damaged)} damaged; STOP ends the last one that it began")
    print(f"longest motion without a heartbeat {unheard:.3f} s")
    print("left:", *(damaged or ["nothing"]), sep="\n  ")
