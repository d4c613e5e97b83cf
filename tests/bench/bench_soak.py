"""Memory of the drive process, the service and the simulated laboratory while runs follow one another at speed 50.

A client asks for the state of the rig every second, as a page does. The resident memory and the part of it that no
other process shares are looked at every 10 s. The growth is the Theil-Sen slope over the second half: in the first one
caches fill, and the journals of drive process and service, which keep 5,000 events.

`MINUTES` in the environment is the duration, 60 by default.
"""

import os
import re
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from scipy.stats import theilslopes

from jointlab.client import Client, Driver
from simlab.laboratory import LaboratoryProcess
from tests.api.conftest import configuration, paper
from tests.bench.bench_stop import service_process
from tests.drive_holder import drive_process, end_drive_process

MINUTES = float(os.environ.get("MINUTES", "60"))
SPEED = 50.0
INTERVAL = 10.0  # s between two looks
WARM_UP = 0.5  # of the duration
SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [0.1, 0.05],
    "frequencies": {"first": 20, "last": 200, "step": 0.5},
}  # fmt: skip
RESIDENT, OWN = re.compile(r"^Rss:\s+(\d+)", re.M), re.compile(r"^Private_\w+:\s+(\d+)", re.M)


def memory(process: int) -> tuple[float, float]:
    """Resident memory of a process, and what of it is its own, MB."""
    text = Path(f"/proc/{process}/smaps_rollup").read_text()
    return tuple(sum(map(int, kind.findall(text))) / 1e3 for kind in (RESIDENT, OWN))  # type: ignore[return-value]  # two


def look(processes: dict[str, int], seen: dict[str, list[tuple[float, float, float]]], began: float) -> None:
    """Add a look at every process."""
    for name, process in processes.items():
        seen[name].append((time.monotonic() - began, *memory(process)))


def measure(lab: Client, driver: Driver, laboratory: LaboratoryProcess) -> int:
    """Do what the rig needs to measure on, and how many sine points the present run has."""
    state = lab.rig()
    if state.phase == "idle":
        driver.start(lab.create_run(paper() | {"steps": [SWEEP]}).id)
    elif state.prompt is not None and state.run_id is not None:
        laboratory.operator.do("mount", specimen="I", configuration="shear")
        driver.answer(state.run_id, state.prompt.number)
    return state.sines


def main() -> None:
    """Measure for so many minutes; print how the memory of each process grew."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="soak-")))
        laboratory = stack.enter_context(LaboratoryProcess(seed=1, speed=SPEED))
        config = folder / "jointlab.toml"
        config.write_text(configuration(laboratory.addresses, folder), encoding="utf-8")
        database = f"sqlite:///{folder / 'jointlab.db'}"
        stack.callback(end_drive_process, folder)
        service, address = stack.enter_context(service_process(config, database, folder / "service.log"))
        processes = {
            "drive process": drive_process(folder),
            "service": service.pid,
            "simulated laboratory": laboratory.process,
        }
        seen = {name: list[tuple[float, float, float]]() for name in processes}
        lab = stack.enter_context(Client(address))
        driver = stack.enter_context(lab.driving("bench"))
        began, looked, points, before = time.monotonic(), 0.0, 0, 0
        while time.monotonic() - began < 60 * MINUTES:
            now = measure(lab, driver, laboratory)
            points, before = points + max(now - before, 0), now
            if time.monotonic() - looked >= INTERVAL:
                looked = time.monotonic()
                look(processes, seen, began)
            time.sleep(1.0)
        driver.pause(lab.rig().run_id or 0)
    print(f"{MINUTES:g} minutes at speed {SPEED:g}, {points} sine points")
    for name, looks in seen.items():
        times, *kinds = np.array(looks).T
        warm = times >= WARM_UP * times[-1]
        for kind, values in zip(("resident", "its own"), kinds, strict=True):
            slope, _, low, high = theilslopes(values[warm], times[warm] / 3600)
            print(
                f"{name:<21}{kind:<9} {values[0]:6.1f} MB at first, {values[-1]:6.1f} MB at last, "
                f"{slope:+7.1f} MB/h ({low:+.1f} to {high:+.1f})",
                flush=True,
            )
