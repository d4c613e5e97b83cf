"""One service and the rigs of a hall: what each further rig costs, how soon reads are answered, and STOP from the hall.

Every rig is a drive process with simulated instruments of its own, all on this computer. All rest: few cores do not
simulate twenty actuators that move. Clients read the rigs twice a second each, as pages do. `RIGS` in the environment
is the list of numbers of rigs, "1 5 10 20" by default, `SECONDS` the duration of each.
"""

import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import httpx
import numpy as np

from jointlab.client import Client
from jointlab.trials.simulated_laboratory import as_toml
from simlab.laboratory import LaboratoryProcess
from tests.bench.bench_soak import memory
from tests.bench.bench_stop import service_process
from tests.ports import free_port
from tests.waiting import LONG, until

RIGS = tuple(map(int, os.environ.get("RIGS", "1 5 10 20").split()))
SECONDS = float(os.environ.get("SECONDS", "60"))
CLIENTS, PAUSE = 20, 0.5
STOPS = 100
TICK = os.sysconf("SC_CLK_TCK")
HEAD = (
    "| rigs | service: cores | service: MB | a drive process: cores | a drive process: MB | reads, ms: median, 95 % "
    "| oldest state, s: 95 % | STOP, ms: median, 99 %, worst |"
)


@dataclass(frozen=True)
class Load:
    """Processor time of a process over time, and the memory that it shares with no other, MB."""

    cores: float
    own_memory: float


def main() -> None:
    """Measure halls of several sizes, and print a line for each."""
    print(HEAD)
    print("|---" * HEAD.count(" | ") + "|---|")
    for count in RIGS:
        with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
            _measure(Path(folder), count, stack)


def _measure(folder: Path, count: int, stack: ExitStack) -> None:
    rigs = [f"B{number}" for number in range(count)]
    ports, drives = [free_port() for _ in rigs], list[int]()
    for number, (rig, port) in enumerate(zip(rigs, ports, strict=True)):
        laboratory = stack.enter_context(LaboratoryProcess(seed=1 + number))
        own = f'[drive]\nfolder = "{folder / rig}"\nstop_port = {port}\n'
        written = _written(folder / f"{rig}.toml", f'rig = "{rig}"\n{as_toml(laboratory.addresses)}\n{own}')
        drives.append(stack.enter_context(_drive_process(written, folder / rig)))
    config = _written(folder / "jointlab.toml", _configuration(folder, dict(zip(rigs, ports, strict=True))))
    service, address = stack.enter_context(
        service_process(config, f"sqlite:///{folder / 'jointlab.db'}", folder / "service.log")
    )
    lab = stack.enter_context(Client(address))
    until(lambda: all(each.state is not None for each in lab.rigs()))
    processes = (service.pid, *drives)
    before, began = [_processor_time(each) for each in processes], time.monotonic()
    reads, ages = _read(address)
    took = time.monotonic() - began
    loads = [
        Load((_processor_time(each) - start) / took, memory(each)[1])
        for each, start in zip(processes, before, strict=True)
    ]
    stops = [_stop(lab, rigs[number % count]) for number in range(STOPS)]
    assert all(each.state is not None and each.state.stop is not None for each in lab.rigs()), "a STOP was lost"
    _show(count, loads, reads, ages, stops)


@contextmanager
def _drive_process(config: Path, folder: Path) -> Iterator[int]:
    """The number of `jointlab drive` as a unit of the system runs it."""
    environment = os.environ | {"JOINTLAB_CONFIG": str(config)}
    with subprocess.Popen([sys.executable, "-m", "api.cli", "drive"], env=environment) as process:
        try:
            until(lambda: process.poll() is not None or (folder / "drive.socket").exists())
            yield process.pid
        finally:
            process.terminate()


def _written(file: Path, text: str) -> Path:
    file.write_text(text, encoding="utf-8")
    return file


def _configuration(folder: Path, stop_ports: Mapping[str, int]) -> str:
    """jointlab.toml of a service that shows and stops the rigs of these names."""
    hall = (
        f'[[hall]]\nrig = "{rig}"\nstop_address = "127.0.0.1"\nstop_port = {port}\n' for rig, port in stop_ports.items()
    )
    return f'rig = "office"\n[drive]\nfolder = "{folder / "office"}"\nstop_port = 0\n{"".join(hall)}'


def _processor_time(process: int) -> float:
    """Seconds of processor time that a process has used."""
    values = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(values[11]) + int(values[12])) / TICK


def _read(address: str) -> tuple[list[float], list[float]]:
    """Milliseconds of each read by all clients, and how old the oldest state of each answer was, s."""
    took, ages, ended = list[float](), list[float](), time.monotonic() + SECONDS

    def be_client(number: int) -> None:
        time.sleep(number * PAUSE / CLIENTS)
        with httpx.Client(base_url=address, timeout=LONG) as http:
            while time.monotonic() < ended:
                began = time.perf_counter()
                rigs = http.get("/api/rigs", params={"limit": 200}).raise_for_status().json()["items"]
                took.append(1e3 * (time.perf_counter() - began))
                heard = min(datetime.fromisoformat(each["heard_at"]) for each in rigs)
                ages.append((datetime.now(UTC) - heard).total_seconds())
                time.sleep(PAUSE)

    threads = [threading.Thread(target=be_client, args=(number,)) for number in range(CLIENTS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return took, ages


def _stop(lab: Client, rig: str) -> float:
    """STOP of a rig; ms until the hall has confirmed it."""
    began = time.perf_counter()
    lab.stop_rig(rig)
    return 1e3 * (time.perf_counter() - began)


def _show(count: int, loads: Sequence[Load], reads: list[float], ages: list[float], stops: list[float]) -> None:
    service, *drives = loads
    cores, own = (np.mean([getattr(each, name) for each in drives]) for name in ("cores", "own_memory"))
    print(
        f"| {count} | {service.cores:.3f} | {service.own_memory:.0f} | {cores:.3f} | {own:.0f} "
        f"| {np.median(reads):.1f}, {np.percentile(reads, 95):.1f} | {np.percentile(ages, 95):.2f} "
        f"| {np.median(stops):.1f}, {np.percentile(stops, 99):.1f}, {max(stops):.1f} |",
        flush=True,
    )


if __name__ == "__main__":
    main()
