"""How many bytes a run of the paper's sequence has, what checks and backups take for them, and what years make of it.

The whole sequence is measured. Identified is that of the demo, which has the same blows and every twentieth sine point.
Times are processor time.
"""

import sqlite3
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jointlab.identification.run import identify_and_save
from jointlab.instruments import instruments_of
from jointlab.runs.carry_out import run_sequence
from jointlab.trials.simulated_laboratory import SimulatedOperator, simulated_laboratory, simulated_settings
from rig.sequence import sequence_from
from store.backup import back_up
from store.catalogue import Catalogue
from store.check import check_file, check_rows, claims
from store.part import every_row
from store.waveforms import SUFFIX, WaveformFolder
from tests.api.conftest import SPEED, demo_sequence, paper
from tests.bench.large_store import GROUP, fill, sizes_of

RIGS, YEARS, TERABYTES = 200, 10, 100
FILES = 20_000
INT4 = 2**31


@dataclass(frozen=True)
class Rates:
    """What is spent on one thing.

    Attributes:
        check, backup: processor seconds for a byte of waveforms.
        row: processor seconds for the checksum of a row.
        listed: processor seconds for a file of the folder that is listed.
        claim: bytes of memory for a reference from a row to a record.
    """

    check: float
    backup: float
    row: float
    listed: float
    claim: float


def main() -> None:
    """Print the figures, and what follows from them."""
    with tempfile.TemporaryDirectory() as folder:
        waveforms, rows = run_of_paper(Path(folder))
        rates = rates_of(Path(folder))
    project(waveforms, rows, rates)


def run_of_paper(folder: Path) -> tuple[int, dict[str, tuple[int, int]]]:
    """Bytes of waveforms of the paper's run, and for each table its rows and their bytes, with indices."""
    with Catalogue.open(f"sqlite:///{folder / 'empty.db'}") as empty:
        before = {name: size for name, (_, size) in sizes_of(empty, empty_too=True).items()}
    with measured(folder / "paper.db", paper()) as (catalogue, _):
        (file,) = catalogue.waveforms.files()
        waveforms = (catalogue.waveforms.folder / file).stat().st_size
        whole = sizes_of(catalogue)
        kinds = record_sizes(catalogue.waveforms.folder / file)
    with measured(folder / "lab.db", demo_sequence()) as (catalogue, run):
        identify_and_save(catalogue, run)
        sizes = sizes_of(catalogue)
    ratio = whole["sine_records"][0] / sizes["sine_records"][0]
    count, size = sizes["dynamic_stiffness"]
    results = sizes | {"dynamic_stiffness": (round(ratio * count), round(ratio * size))}
    rows = {name: (count, size - before[name]) for name, (count, size) in (results | whole).items()}
    print(f"a run of {rows['sine_records'][0]} sine points and {rows['blows'][0]} blows, all identified:")
    for values in (min(kinds), max(kinds)):
        records, size = kinds[values]
        a_value = size / records / values
        print(f"  {records} records of {values} values: {size / records:.0f} bytes each, {a_value:.2f} a value")
    print(f"  waveforms {waveforms / 1e6:.2f} MB, rows {sum(size for _, size in rows.values()) / 1e6:.2f} MB, of that")
    for name, (count, size) in sorted(rows.items(), key=lambda each: -each[1][1])[:8]:
        print(f"    {name:<26} {count:6} rows, {size / 1e3:7.0f} kB")
    return waveforms, rows


@contextmanager
def measured(path: Path, document: dict[str, Any]) -> Iterator[tuple[Catalogue, int]]:
    """A catalogue with the run of a sequence on simulated instruments, and the number of the run."""
    with simulated_laboratory(1, SPEED) as laboratory:
        settings = simulated_settings(laboratory.addresses, database_url=f"sqlite:///{path}")
        with Catalogue.open(settings.database_url) as catalogue:
            operator = SimulatedOperator(laboratory.operator)
            sequence = sequence_from(document)
            yield catalogue, run_sequence(sequence, instruments_of(settings), catalogue, operator, operator.observe)


def record_sizes(path: Path) -> dict[int, tuple[int, int]]:
    """Of the records of a waveform file with the same number of values: how many there are, and bytes."""
    values = "json_extract(header, '$.shape[0]') * json_extract(header, '$.shape[1]')"
    query = f"SELECT {values}, count(*), sum(length(samples) + length(header)) FROM records GROUP BY 1 ORDER BY 1"
    with closing(sqlite3.connect(path)) as connection:
        return {number: (records, size) for number, records, size in connection.execute(query)}


def rates_of(folder: Path) -> Rates:
    """Measure them on what `run_of_paper` has stored, and on rows of a thousand runs."""
    with Catalogue.open(f"sqlite:///{folder / 'lab.db'}") as catalogue:
        (file,) = catalogue.waveforms.files()
        size = (catalogue.waveforms.folder / file).stat().st_size
        with catalogue.reading() as session:
            claim = claims(session)[file]
        check_s = min(taken(lambda: check_file(catalogue.waveforms, file, claim)) for _ in range(5)) / size
        backup_s = taken(lambda: back_up(catalogue, folder / "backup")) / size
    with Catalogue.open(f"sqlite:///{folder / 'rows.db'}") as catalogue:
        fill(catalogue, 0, GROUP)
        rows = sum(n for name, (n, _) in sizes_of(catalogue).items() if name in ("sine_records", "blows", "points"))
        row_s = taken(lambda: check_rows(catalogue, every_row())) / rows
        with catalogue.reading() as session:
            tracemalloc.start()
            claimed = claims(session)
            memory = tracemalloc.get_traced_memory()[0]
            tracemalloc.stop()
        claim_bytes = memory / sum(each.records.total() for each in claimed.values())
    many = folder / "many"
    many.mkdir()
    for number in range(FILES):
        (many / f"{number}{SUFFIX}").touch()
    return Rates(check_s, backup_s, row_s, taken(lambda: list(WaveformFolder(many).files())) / FILES, claim_bytes)


def taken(work: Callable[[], object]) -> float:
    """Seconds of processor time."""
    began = time.process_time()
    work()
    return time.process_time() - began


def project(waveforms: int, rows: dict[str, tuple[int, int]], rates: Rates) -> None:
    """Print what the figures make for all rigs, years and terabytes."""
    size = sum(size for _, size in rows.values())
    runs = 1e12 * TERABYTES / waveforms
    a_day = runs / (RIGS * YEARS * 365)
    records = runs * (rows["sine_records"][0] + rows["blows"][0])
    print(f"{TERABYTES} TB of waveforms: {runs:.3g} runs, {a_day:.1f} a day and rig")
    print(f"  rows: {runs * size / 1e12:.2f} TB on SQLite, {records:.3g} records")
    for name in ("joint_elements", "blows", "frequency_responses"):
        number = runs * rows[name][0]
        print(f"  {name:<24} {number:.3g} rows; {INT4} are reached after {YEARS * INT4 / number:.1f} years")
    print(f"  check of all waveforms: {1e-6 / rates.check:.0f} MB/s, {rates.check * 1e12 * TERABYTES / 86400:.1f} days")
    print(f"  backup: {1e-6 / rates.backup:.0f} MB/s, {rates.backup * 1e12 * TERABYTES / 86400:.1f} days")
    a_night = 8 * 3600 / rates.backup / 1e12
    print(f"  a backup in 8 hours: {a_night:.2f} TB, reached after {365 * YEARS * a_night / TERABYTES:.0f} days")
    print(f"  check of rows: {rates.row * 1e6:.0f} µs a row, {rates.row * records / 86400:.1f} days")
    print(f"  memory of check and backup: {rates.claim:.0f} bytes a record, {rates.claim * records / 1e9:.0f} GB")
    print(f"  list of files: {rates.listed * 1e6:.1f} µs a file, {rates.listed * runs:.0f} s")


if __name__ == "__main__":
    main()
