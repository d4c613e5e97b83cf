"""How many bytes a run of the paper's sequence has, what checks and backups take for them, and what years make of it.

The whole sequence is measured. Identified is that of the demo, which has the same blows and every twentieth sine point.
Times are processor time.
"""

import hashlib
import shutil
import sqlite3
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from sqlalchemy import insert, select

from jointlab.identification.run import identify_and_save
from jointlab.instruments import instruments_of
from jointlab.runs.carry_out import run_sequence
from jointlab.trials.simulated_laboratory import simulated_laboratory, simulated_settings
from jointlab.trials.simulated_operator import SimulatedOperator
from rig.sequences.sequence import sequence_from
from store.backup.backup import back_up
from store.backup.check import Claim, check, check_rows, claims
from store.backup.checked_part import every_row
from store.catalogue import Catalogue
from store.measurements.runs import count_runs
from store.models.measurements import BlowRow, PointRow, RunRow, SineRecordRow
from store.waveforms.folder import SUFFIX, WaveformFolder
from tests.api.conftest import SPEED, demo_sequence, paper
from tests.bench.large_store import GROUP, fill, sizes_of

RIGS, YEARS, TERABYTES = 200, 10, 100
FILES = 20_000
COPIES = (4, 12)
"""Runs of the store that is checked."""
FURTHER = 10_000
"""Between the numbers of rows of one copy and of the next."""
INT4 = 2**31


@dataclass(frozen=True)
class Rates:
    """What is spent on one thing.

    Attributes:
        read, check, backup: processor seconds for a byte of waveforms: of SHA-256 alone, a check and a backup of all.
        row: processor seconds for the checksum of a row.
        listed: processor seconds for a file of the folder that is listed.
        claim: bytes of memory of a backup for a reference from a row to a record.
    """

    read: float
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
    """Measure them on repetitions of what `run_of_paper` has stored, and on rows of a thousand runs."""
    with Catalogue.open(f"sqlite:///{folder / 'paper.db'}") as catalogue:
        read_s, check_s, backup_s = rates_of_checks(catalogue, folder)
    with Catalogue.open(f"sqlite:///{folder / 'rows.db'}") as catalogue:
        fill(catalogue, 0, GROUP)
        rows = sum(n for name, (n, _) in sizes_of(catalogue).items() if name in ("sine_records", "blows", "points"))
        row_s = taken(lambda: check_rows(catalogue, every_row())) / rows
        with catalogue.reading() as session:
            claimed = dict[str, Claim]()
            memory = memory_of(lambda: claimed.update(claims(session)))
        claim_bytes = memory / sum(each.records.total() for each in claimed.values())
    many = folder / "many"
    many.mkdir()
    for number in range(FILES):
        (many / f"{number}{SUFFIX}").touch()
    listed_s = taken(lambda: list(WaveformFolder(many).files())) / FILES
    return Rates(read_s, check_s, backup_s, row_s, listed_s, claim_bytes)


def rates_of_checks(catalogue: Catalogue, folder: Path) -> tuple[float, float, float]:
    """Processor seconds for a byte of waveforms of SHA-256, a check and a backup; each in turn, the least of three."""
    size = 0
    for copies in COPIES:
        repeat_run(catalogue, copies)
        paths = [catalogue.waveforms.folder / file for file in catalogue.waveforms.files()]
        size = sum(path.stat().st_size for path in paths)
        print(f"memory of a check of {len(paths)} runs: {memory_of(lambda: check(catalogue)) / 1e6:.1f} MB")
    read, checked, copied = list[float](), list[float](), list[float]()
    for repetition in range(3):
        backup = folder / f"backup{repetition}"
        began = time.monotonic()
        read.append(taken(lambda: [hashlib.sha256(path.read_bytes()) for path in paths]))
        checked.append(taken(lambda: check(catalogue)))
        copied.append(taken(partial(back_up, catalogue, backup)))
        spent = f"{read[-1]:.2f}, {checked[-1]:.2f}, {copied[-1]:.2f} s of processor time"
        print(
            f"  SHA-256, check, backup of {size / 1e6:.0f} MB: {spent}, {time.monotonic() - began:.1f} s on the clock"
        )
        shutil.rmtree(backup)
    return min(read) / size, min(checked) / size, min(copied) / size


def repeat_run(catalogue: Catalogue, copies: int) -> None:
    """Let the first run be there so many times, each with its records and their file."""
    with catalogue.writing() as session:
        there = count_runs(session)
        tables = {row: [values_of(each) for each in session.scalars(of)] for row, of in rows_of_first().items()}
        (run,) = tables[RunRow]
        for copy in range(there + 1, copies + 1):
            file = f"{copy}{SUFFIX}"
            shutil.copy(catalogue.waveforms.folder / run["waveform_file"], catalogue.waveforms.folder / file)
            run_values = {"waveform_file": file}
            for row, values in tables.items():
                moved = [
                    each | {key: each[key] + copy * FURTHER for key in ("id", "run_id", "point_id") if key in each}
                    for each in values
                ]
                session.execute(insert(row), [each | run_values for each in moved] if row is RunRow else moved)


def rows_of_first() -> dict[Any, Any]:
    """Of the first run: its tables, and what selects their rows."""
    return {
        RunRow: select(RunRow).where(RunRow.id == 1),
        PointRow: select(PointRow).where(PointRow.run_id == 1),
        BlowRow: select(BlowRow).join(BlowRow.point).where(PointRow.run_id == 1),
        SineRecordRow: select(SineRecordRow).where(SineRecordRow.run_id == 1),
    }


def values_of(row: Any) -> dict[str, Any]:
    """The values of a row but for its checksum."""
    return {column.name: getattr(row, column.name) for column in row.__table__.columns if column.name != "checksum"}


def memory_of(work: Callable[[], object]) -> int:
    """Bytes that Python takes at most."""
    tracemalloc.start()
    work()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


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
    print(
        f"  SHA-256 alone: {1e-6 / rates.read:.0f} MB/s; check and backup take {rates.check / rates.read:.1f} and ",
        end="",
    )
    print(f"{rates.backup / rates.read:.1f} times as long")
    print(f"  check of all: {1e-6 / rates.check:.0f} MB/s, {rates.check * 1e12 * TERABYTES / 86400:.1f} days")
    print(f"  backup: {1e-6 / rates.backup:.0f} MB/s, {rates.backup * 1e12 * TERABYTES / 86400:.1f} days")
    a_night = 8 * 3600 / rates.backup / 1e12
    print(f"  a backup in 8 hours: {a_night:.2f} TB, reached after {365 * YEARS * a_night / TERABYTES:.0f} days")
    print(f"  check of rows: {rates.row * 1e6:.0f} µs a row, {rates.row * records / 86400:.1f} days")
    print(f"  memory of a backup: {rates.claim:.0f} bytes a record, {rates.claim * records / 1e9:.0f} GB")
    print(f"  list of files: {rates.listed * 1e6:.1f} µs a file, {rates.listed * runs:.0f} s")


if __name__ == "__main__":
    main()
