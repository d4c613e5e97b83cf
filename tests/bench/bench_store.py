"""What keeping one record costs on SQLite: its waveform and its row, each with a full-sync commit of its own."""

import os
import tempfile
import time
from pathlib import Path

import numpy as np

from store.catalogue import Catalogue
from store.dof import StoredDof
from store.measurements.blows import add_blow, add_point
from store.measurements.runs import Run, start_run
from store.measurements.sine_records import SineRecord, add_sine_record
from store.waveforms.waveform import Waveform, WaveformChannel

RECORDS = 200


def main() -> None:
    """Print the median and 99th percentile of each kind of record beside two synchronised writes of the disk."""
    with tempfile.TemporaryDirectory() as folder, Catalogue.open(f"sqlite:///{Path(folder) / 'lab.db'}") as catalogue:
        with catalogue.writing() as session:
            run = start_run(session, kind="sequence", title="benchmark", article="none", setup={})
        disk = [2 * synchronised_write(Path(folder) / "disk") for _ in range(RECORDS)]
        print_row("two synchronised writes of 40 kB", disk)
        print_row("sine record, 2 x 5000 samples", sine_records(catalogue, run))
        print_row("blow, 2 x 10240 samples", blows(catalogue, run))


def sine_records(catalogue: Catalogue, run: Run) -> list[float]:
    """Seconds of each sine record."""
    waveform, took = record(5000), []
    for number in range(1, RECORDS + 1):
        began = time.perf_counter()
        reference = catalogue.waveforms.append(run.waveform_file, waveform)
        with catalogue.writing() as session:
            sine = SineRecord(number, "I", "shear", 0.1, 0.1, 5.0, 1.0, None, 23.0, reference)
            add_sine_record(session, run.id, sine)
        took.append(time.perf_counter() - began)
    return took


def blows(catalogue: Catalogue, run: Run) -> list[float]:
    """Seconds of each blow."""
    waveform, took = record(10_240), []
    with catalogue.writing() as session:
        point = add_point(session, run.id, StoredDof(1, "y"))
    for number in range(1, RECORDS + 1):
        began = time.perf_counter()
        reference = catalogue.waveforms.append(run.waveform_file, waveform)
        with catalogue.writing() as session:
            add_blow(session, point, number, accepted=True, waveform=reference)
        took.append(time.perf_counter() - began)
    return took


def record(samples: int) -> Waveform:
    """Two channels of a noisy sine in counts."""
    phase = np.arange(samples) * 0.3
    noise = np.random.default_rng(6).normal(0, 60, (2, samples))
    counts = (2e6 * np.stack([np.sin(phase), np.cos(phase)]) + noise).astype(np.int32)
    return Waveform((WaveformChannel("a", "m"), WaveformChannel("b", "N")), counts, 5000.0)


def synchronised_write(path: Path) -> float:
    """Seconds that the disk takes by itself."""
    began = time.perf_counter()
    with path.open("ab") as file:
        file.write(bytes(40_000))
        os.fsync(file.fileno())
    return time.perf_counter() - began


def print_row(what: str, seconds: list[float]) -> None:
    """One row of the table."""
    milliseconds = 1e3 * np.array(seconds)
    median, worst = np.median(milliseconds), np.percentile(milliseconds, 99)
    print(f"{what:<36} median {median:7.2f} ms   99 % {worst:7.2f} ms", flush=True)
