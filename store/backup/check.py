"""The check of a catalogue and its waveforms: checksums of rows, arrays and records, references, the audit log.

It only reads, also while a run is on.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice

from sqlalchemy import ForeignKeyConstraint, LargeBinary, Select, Table, and_, func, select, text
from sqlalchemy.orm import Session

from store.backup.checked_part import WHOLE, Part, Rows, every_row, rows_of, rows_of_no_run
from store.catalogue import Catalogue
from store.database.checksums import checksum, stored_rows
from store.database.columns import decode_optional
from store.errors import RESTORE, DamagedError, NotFoundError, StoreError
from store.measurements.runs import run_in_short
from store.models.measurements import BlowRow, PointRow, RunRow, SineRecordRow
from store.progress import Advance, Progress, silent
from store.service.audit import read_chain
from store.states import RunState
from store.waveforms.folder import WaveformFolder

# Rows with arrays that are in memory at a time.
_ROWS_AT_ONCE = 200
_FILES_AT_ONCE = 500


@dataclass(frozen=True)
class Finding:
    """One fault.

    Attributes:
        where: the table and row, or the waveform file and record.
        what: the fault.
        remedy: what to do.
        damage: False where nothing is lost: a record or file is left over to which no row refers.
    """

    where: str
    what: str
    remedy: str
    damage: bool = True

    def __str__(self) -> str:
        return f"{self.where}: {self.what}; {self.remedy}"


@dataclass
class Claim:
    """References from the rows of one run to its waveform file.

    Attributes:
        run: the run's number.
        running: whether records without a row are to be expected, because a row follows its record.
        records: how many rows refer to each record.
    """

    run: int
    running: bool
    records: Counter[int] = field(default_factory=Counter)


def check(catalogue: Catalogue, progress: Progress = silent, part: Part = WHOLE) -> list[Finding]:
    """All faults of a catalogue and its waveforms, or of a part of them; memory does not grow with the runs.

    Of each run every record is verified against its checksum, every row of measurements and every array of the results
    too, and every reference is followed, between rows and from rows to waveforms and back. What belongs to no run is
    checked with the first share of all runs: instruments, the audit log along its chain, files that nothing refers to.

    Raises:
        NotFoundError: there is no run of a number that is given.
    """
    with catalogue.reading() as session:
        for number in part.runs:
            run_in_short(session, number)
    # Of everything, each table is read as a whole: that finds rows, too, which no index or reference leads to any more.
    is_whole = part == WHOLE
    alone = every_row() if is_whole else rows_of_no_run()
    found = _check_rest(catalogue, alone, progress) if part.is_first else []
    with _noted("table runs", found), progress("runs", part.count(catalogue)) as advance:
        for runs in part.batches(catalogue):
            rows = [] if is_whole else rows_of(runs)
            if not part.is_first:  # which has followed those of every row
                found += _check_references(catalogue, rows)
            found += [*_check_arrays(catalogue, rows), *check_rows(catalogue, rows)]
            found += _check_waveforms(catalogue, runs, advance)
    return list(dict.fromkeys(found))  # a result of several runs was looked at more than once


def claims(session: Session, runs: Sequence[int] | None = None) -> dict[str, Claim]:
    """References from rows to records, by waveform file: of some runs, or of all."""
    chosen = () if runs is None else (RunRow.id.in_(runs),)
    found = {
        file: Claim(number, state == RunState.RUNNING)
        for number, file, state in session.execute(select(RunRow.id, RunRow.waveform_file, RunRow.state).where(*chosen))
    }
    blows = select(RunRow.waveform_file, BlowRow.waveform_record).select_from(BlowRow)
    blows = blows.join(BlowRow.point).join(PointRow.run)
    sines = select(RunRow.waveform_file, SineRecordRow.waveform_record).join(SineRecordRow.run)
    for query in (blows, sines):
        for file, record in session.execute(query.where(*chosen)):
            if record is not None:
                found[file].records[record] += 1
    return found


def check_file(folder: WaveformFolder, file: str, claim: Claim) -> list[Finding]:
    """Faults of one waveform file, and of the references to it."""
    where = f"waveform file {file}"
    found, present = [], set()
    try:
        for number, damage in folder.verify(file):
            present.add(number)
            if damage is not None:
                found.append(Finding(damage.where, damage.what, RESTORE))
    except NotFoundError:
        if claim.records:
            remedy = "bring it back, or restore it from a backup"
            found.append(Finding(where, f"is missing; {claim.records.total()} rows of run {claim.run} need it", remedy))
        return found
    except DamagedError as error:
        found.append(Finding(error.where, error.what, RESTORE))
    except StoreError as error:
        found.append(Finding(where, str(error), "make it readable"))
        return found
    missing = sorted(claim.records.keys() - present)
    if missing:
        found.append(Finding(where, f"rows of run {claim.run} refer to {_listed(missing)}, not in it", RESTORE))
    shared = sorted(number for number, rows in claim.records.items() if rows > 1)
    if shared:
        found.append(Finding(where, f"several rows of run {claim.run} refer to {_listed(shared)}", RESTORE))
    left = sorted(present - claim.records.keys())
    if left and not claim.running:
        what = f"no row of run {claim.run} refers to {_listed(left)}"
        remedy = "left by a program that was cut off between record and row; nothing needs to be done"
        found.append(Finding(where, what, remedy, damage=False))
    return found


def _check_structure(catalogue: Catalogue) -> list[Finding]:
    """Faults that SQLite finds in its own file; PostgreSQL checks its files itself."""
    found: list[Finding] = []
    with _noted(f"database {catalogue.address}", found), catalogue.reading(long=True) as session:
        if session.get_bind().dialect.name == "sqlite":
            said = session.scalars(text("PRAGMA integrity_check(20)")).all()
            found += [Finding(f"database {catalogue.address}", line, RESTORE) for line in said if line != "ok"]
    return found


def _check_references(catalogue: Catalogue, rows: Sequence[Rows]) -> list[Finding]:
    found: list[Finding] = []
    for table, chosen in rows:
        for key in table.foreign_key_constraints:
            with _noted(f"table {table.name}", found), catalogue.reading(long=True) as session:
                dangling = session.scalar(_count_dangling(table, key).where(*chosen)) or 0
                if dangling:
                    what = f"{dangling} rows refer to {key.referred_table.name} that are not there"
                    found.append(Finding(f"table {table.name}, {', '.join(key.column_keys)}", what, RESTORE))
    return found


def _count_dangling(table: Table, key: ForeignKeyConstraint) -> Select[int]:
    target = key.referred_table.alias()
    pairs = [(element.parent, target.c[element.column.name]) for element in key.elements]
    there = select(1).select_from(target).where(and_(*(one == other for one, other in pairs))).exists()
    return select(func.count()).select_from(table).where(*(one.is_not(None) for one, _ in pairs), ~there)


def _check_arrays(catalogue: Catalogue, rows: Sequence[Rows]) -> list[Finding]:
    """Every binary column holds arrays (`store.database.columns`)."""
    found: list[Finding] = []
    for table, chosen in rows:
        columns = [column for column in table.columns if isinstance(column.type, LargeBinary)]
        if not columns:
            continue
        with _noted(f"table {table.name}", found), catalogue.reading(long=True) as session:
            query = select(table.c.id, *columns).where(*chosen).execution_options(yield_per=_ROWS_AT_ONCE)
            for number, *values in session.execute(query):
                for column, value in zip(columns, values, strict=True):
                    try:
                        decode_optional(value, f"table {table.name}, row {number}, {column.name}")
                    except DamagedError as error:
                        found.append(Finding(error.where, error.what, RESTORE))
    return found


def check_rows(catalogue: Catalogue, rows: Sequence[Rows]) -> list[Finding]:
    """Each row of measurements has a checksum over its values (`store.database.checksums`)."""
    found: list[Finding] = []
    for table, chosen in rows:
        if "checksum" not in table.c:
            continue
        with _noted(f"table {table.name}", found), catalogue.reading(long=True) as session:
            for keys, values in stored_rows(session.connection(), table, *chosen):
                stored = str(keys.pop("checksum"))
                if stored != checksum(stored[:1], values):
                    row = "-".join(str(key) for key in keys.values())
                    what = "its values and its checksum do not fit" if stored else "it has no checksum"
                    found.append(Finding(f"table {table.name}, row {row}", what, RESTORE))
    return found


def _check_waveforms(catalogue: Catalogue, runs: Sequence[int], advance: Advance) -> list[Finding]:
    found, claimed = list[Finding](), dict[str, Claim]()
    with _noted("rows that refer to waveforms", found), catalogue.reading(long=True) as session:
        claimed = claims(session, runs)
    for file, claim in claimed.items():
        found += check_file(catalogue.waveforms, file, claim)
        advance(1)
    return found


def _check_rest(catalogue: Catalogue, alone: Sequence[Rows], progress: Progress) -> list[Finding]:
    """What belongs to no run or to all of them; of `alone` arrays and checksums, too."""
    found, tables = _check_structure(catalogue), every_row()
    with progress("tables", len(tables) + len(alone)) as advance:
        for rows in tables:
            found += _check_references(catalogue, [rows])
            advance(1)
        for rows in alone:
            found += [*_check_arrays(catalogue, [rows]), *check_rows(catalogue, [rows])]
            advance(1)
    with _noted("table audit_entries", found), catalogue.reading(long=True) as session:
        found += [Finding("audit log", fault, RESTORE) for fault in read_chain(session).faults]
    with _noted("folder of waveforms", found):
        listed = catalogue.waveforms.files()
        while files := list(islice(listed, _FILES_AT_ONCE)):
            # A run that begins meanwhile has its row before its file.
            with catalogue.reading() as session:
                known = set(session.scalars(select(RunRow.waveform_file).where(RunRow.waveform_file.in_(files))))
            found += [_left_over(file) for file in files if file not in known]
    return found


def _left_over(file: str) -> Finding:
    remedy = "left by an import that was cut off; if no import is running, move it away"
    return Finding(f"waveform file {file}", "no run refers to it", remedy, damage=False)


def _listed(numbers: list[int]) -> str:
    shown = ", ".join(map(str, numbers[:5]))
    return f"record {shown}" if len(numbers) == 1 else f"{len(numbers)} records ({shown}{', ...' * (len(numbers) > 5)})"


@contextmanager
def _noted(where: str, found: list[Finding]) -> Iterator[None]:
    """Report an error of reading as a fault, and go on with the next check."""
    try:
        yield
    except StoreError as error:
        found.append(Finding(where, f"cannot be read ({error})", RESTORE))
