"""20 clients who read, and a sweep that runs: how soon reads are answered, how soon STOP has stopped, what is lost.

The rig is simulated, in real time and in a process of its own; the service is another process, the clients a third.
How late this machine wakes somebody who sleeps is measured beside it, because no answer can be sooner than that.
"""

import multiprocessing
import tempfile
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from jointlab.client import Client, Driver
from simlab.laboratory import LaboratoryProcess
from store.catalogue import Catalogue
from store.measurements.sine_records import list_sine_records
from store.service.keys import add_key
from store.states import Scope
from tests.api.commands.test_service import serving_process
from tests.api.conftest import configuration, paper
from tests.bench.bench_stop import RAMP
from tests.store.conftest import fill

CLIENTS, LOOKS_A_SECOND, STOPS = 20, 2.0, 100
READ_LIMIT_MS, STOP_LIMIT_MS = 150.0, 100.0
SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [0.1, 0.05],
    "frequencies": {"first": 20, "last": 200, "step": 0.25},
}  # fmt: skip
PATHS = (
    "/api/rig", "/api/runs", "/api/runs/1", "/api/runs/1/blows", "/api/runs/1/joint-matrices", "/api/runs/1/modes",
    "/api/runs/2/dynamic-stiffness", "/api/dynamic-stiffness?article=beam%203", "/api/jobs", "/api/blows/1/waveform",
)  # fmt: skip


@dataclass
class Readings:
    """Milliseconds of each read, and what was answered otherwise than asked."""

    took: list[float] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)


def main() -> None:
    """Measure with readers who look twice a second, then with readers who never rest."""
    for name, pause in (
        (f"{CLIENTS} clients, {LOOKS_A_SECOND:g} reads a second each", 1 / LOOKS_A_SECOND),
        (f"{CLIENTS} clients that never rest", 0.0),
    ):
        print(name, flush=True)
        with tempfile.TemporaryDirectory() as folder, LaboratoryProcess(seed=1, speed=1.0) as laboratory:
            _measure(Path(folder), laboratory, pause)


def _measure(folder: Path, laboratory: LaboratoryProcess, pause: float) -> None:
    (folder / "jointlab.toml").write_text(configuration(laboratory.addresses, folder), encoding="utf-8")
    with Catalogue.open(f"sqlite:///{folder / 'jointlab.db'}") as catalogue:
        fill(catalogue)
        with catalogue.writing() as session:
            _, secret = add_key(session, "bench", list(Scope))
    context = multiprocessing.get_context("spawn")
    with serving_process(folder) as (address, _), Client(address, secret) as lab:
        run = lab.create_run(paper() | {"steps": [SWEEP]}).id
        ended, answers = context.Event(), context.Queue()
        reader = context.Process(target=_read, args=(address, secret, pause, ended, answers), daemon=True)
        with lab.driving("bench") as driver:
            driver.start(run)
            _mount(lab, driver, laboratory, run)
            reader.start()
            late = _Lateness()
            stops = [_stop(lab, driver, laboratory, run, number) for number in range(STOPS)]
            ended.set()
            readings: Readings = answers.get()
            reader.join()
            _show("reads", readings.took, f"95th percentile below {READ_LIMIT_MS:g} ms wanted")
            _show("STOP, request to confirmed rest", stops, "")
            wanted = f"99th percentile below {STOP_LIMIT_MS:g} ms wanted"
            _show(f"less the instrument's ramp of {1e3 * RAMP:.0f} ms", [took - 1e3 * RAMP for took in stops], wanted)
            _show("this machine: late to wake a sleeper", late.end(), "")
        print(f"  reads answered otherwise: {len(readings.failed)} {readings.failed[:3]}")
    _show_records(folder, run)


def _mount(lab: Client, driver: Driver, laboratory: LaboratoryProcess, run: int) -> None:
    while (prompt := lab.rig().prompt) is None:
        time.sleep(0.05)
    laboratory.operator.do("mount", specimen="I", configuration="shear")
    driver.answer(run, prompt.number)


def _stop(lab: Client, driver: Driver, laboratory: LaboratoryProcess, run: int, number: int) -> float:
    """Let the sweep run for a while, stop it, and let it go on; ms that the stop took."""
    sines = lab.rig().sines
    while lab.rig().sines < sines + 1:
        time.sleep(0.1)
    time.sleep(float(np.random.default_rng(number).uniform(0.0, 1.0)))
    began = time.perf_counter()
    lab.stop()
    took = 1e3 * (time.perf_counter() - began)
    while lab.rig().phase != "idle":
        time.sleep(0.05)
    driver.reset_stop()
    driver.resume(run)
    _mount(lab, driver, laboratory, run)
    return took


def _read(address: str, secret: str, pause: float, ended: Any, answers: Any) -> None:
    """Be all the clients, a thread and a connection each."""
    readings = Readings()
    given = (address, secret, pause, ended, readings)
    threads = [threading.Thread(target=_be_client, args=(*given, number)) for number in range(CLIENTS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    answers.put(readings)


def _be_client(address: str, secret: str, pause: float, ended: Any, readings: Readings, number: int) -> None:
    headers = {"Authorization": f"Bearer {secret}"}
    with httpx.Client(base_url=address, headers=headers, timeout=30.0) as http:
        count = number
        while not ended.is_set():
            path = PATHS[count % len(PATHS)]
            count += 1
            began = time.perf_counter()
            try:
                answer = http.get(path)
            except httpx.TransportError as error:
                readings.failed.append(f"{path}: {error}")
                return
            readings.took.append(1e3 * (time.perf_counter() - began))
            if answer.status_code != 200:
                readings.failed.append(f"{path}: {answer.status_code}")
            time.sleep(pause)


class _Lateness:
    """How late a thread that sleeps for 5 ms is woken, ms."""

    def __init__(self) -> None:
        self._late = list[float]()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._sleep)
        self._thread.start()

    def _sleep(self) -> None:
        while not self._ended.is_set():
            began = time.perf_counter()
            time.sleep(0.005)
            self._late.append(1e3 * (time.perf_counter() - began) - 5.0)

    def end(self) -> list[float]:
        self._ended.set()
        self._thread.join()
        return self._late


def _show(what: str, took: list[float], wanted: str) -> None:
    median, most, almost_all, worst = np.percentile(np.array(took), [50, 95, 99, 100])
    print(
        f"  {what:<40} {len(took):6d}: median {median:7.1f} ms, 95 % {most:7.1f} ms, 99 % {almost_all:7.1f} ms, "
        f"worst {worst:7.1f} ms   {wanted}",
        flush=True,
    )


def _show_records(folder: Path, run: int) -> None:
    """Every record is whole: each sample of both channels is there, and each point once."""
    with Catalogue.open(f"sqlite:///{folder / 'jointlab.db'}") as catalogue:
        with catalogue.reading() as session:
            records = list_sine_records(session, run)
        lengths = set()
        for record in records:
            assert record.waveform is not None
            waveform = catalogue.waveforms.read(record.waveform)
            lengths.add(round(waveform.samples.shape[1] / waveform.sample_rate, 3))
    orders = [record.order_number for record in records]
    print(
        f"  {len(records)} sine points stored, {len(orders) - len(set(orders))} twice, "
        f"{max(orders) - len(set(orders))} lost; records of {min(lengths):g} to {max(lengths):g} s"
    )
