"""The folder of waveforms: one append-only file per run, each an SQLite database of checked records.

Why SQLite files beside the catalogue: docs/decisions/0002-waveforms-beside-the-catalogue.md.
"""

import os
import sqlite3
import threading
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from store.database.connection import driver_message, prepare_sqlite
from store.database.time_limits import DEFAULT_LIMITS, TimeLimits, seconds_left
from store.errors import DamagedError, NotFoundError, StoreError
from store.waveforms.waveform import Waveform, WaveformReference
from store.waveforms.waveform_codec import Encoded, decode, encode

SUFFIX = ".waveforms"
_SCHEMA = """
CREATE TABLE records (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    header TEXT NOT NULL,
    samples BLOB NOT NULL,
    crc INTEGER NOT NULL
);
CREATE TRIGGER records_are_never_changed BEFORE UPDATE ON records
    BEGIN SELECT RAISE(ABORT, 'raw data are never changed'); END;
CREATE TRIGGER records_are_never_deleted BEFORE DELETE ON records
    BEGIN SELECT RAISE(ABORT, 'raw data are never deleted'); END;
"""


class WaveformFolder:
    """Appends and reads waveforms; one connection stays open for each file that is being written."""

    def __init__(self, folder: Path, limits: TimeLimits = DEFAULT_LIMITS) -> None:
        self._folder = folder
        self._limits = limits
        self._writers: dict[str, sqlite3.Connection] = {}
        self._lock = threading.Lock()

    @property
    def folder(self) -> Path:
        """Where the files are."""
        return self._folder

    def append(self, file: str, waveform: Waveform) -> WaveformReference:
        """Add a record to a run's file; it survives a power cut then. StoreError if the file cannot be written."""
        return self.append_all(file, [waveform])[0]

    def append_all(self, file: str, waveforms: Sequence[Waveform]) -> list[WaveformReference]:
        """Add several records in one commit: all of them or none. StoreError if the file cannot be written."""
        rows = [encode(waveform) for waveform in waveforms]
        path = self._path(file)
        with self._lock, _explained(path, "written"):
            writer = self._writer(file)
            with writer:
                writer.execute("BEGIN IMMEDIATE")
                return [WaveformReference(file, _add(writer, row)) for row in rows]

    def append_once(self, file: str, rows: Sequence[Encoded], after: int) -> list[WaveformReference]:
        """Add encoded waveforms in one commit, but for those that were added before.

        Args:
            rows: the waveforms, in order.
            after: number of the last record that the catalogue refers to; what is after it was added by an attempt that
                was lost before it could store the references, and is taken where it is the same.

        Raises StoreError if the file cannot be written.
        """
        path, found = self._path(file), list[WaveformReference]()
        with self._lock, _explained(path, "written"):
            writer = self._writer(file)
            with writer:
                writer.execute("BEGIN IMMEDIATE")
                for row in rows:
                    after = _same(writer, row, after) or _add(writer, row)
                    found.append(WaveformReference(file, after))
        return found

    def read(self, reference: WaveformReference) -> Waveform:
        """A record, verified against its checksum.

        Raises NotFoundError if there is no such file or record, DamagedError if the record is damaged.
        """
        with self._reader(reference.file, str(reference)) as reader:
            return _record(reader, reference)

    def records(self, file: str) -> list[WaveformReference]:
        """Every record of a file, in the order of writing; NotFoundError if there is no such file."""
        with self._reader(file, file) as reader:
            numbers = reader.execute("SELECT number FROM records ORDER BY number").fetchall()
        return [WaveformReference(file, number) for (number,) in numbers]

    def verify(self, file: str) -> Iterator[tuple[int, DamagedError | None]]:
        """Number of each record of a file, and its damage or None.

        Raises:
            NotFoundError: there is no such file.
            DamagedError: the file's own structure is damaged, or records are missing from within.
            StoreError: the file cannot be read.
        """
        with self._reader(file, file) as reader:
            if reader.execute("SELECT count(*) FROM sqlite_master").fetchone() == (0,):
                return  # made by a writer that was interrupted before its first record
            numbers = [number for (number,) in reader.execute("SELECT number FROM records ORDER BY number")]
            for number in numbers:
                yield number, _damage(reader, WaveformReference(file, number))
            lost = sorted({*range(1, max(numbers, default=0))} - {*numbers})
            if lost:
                raise DamagedError(f"waveform file {file}", f"{len(lost)} records from number {lost[0]} on are missing")
            for (said,) in reader.execute("PRAGMA quick_check(1)"):
                if said != "ok":
                    raise DamagedError(f"waveform file {file}", f"its structure is damaged ({said.splitlines()[-1]})")

    def files(self) -> Iterator[str]:
        """Names of all waveform files in the folder, in no order; StoreError if it cannot be read."""
        try:
            with suppress(FileNotFoundError), os.scandir(self._folder) as entries:
                yield from (entry.name for entry in entries if entry.name.endswith(SUFFIX))
        except OSError as error:
            raise StoreError(f"the folder {self._folder} cannot be listed: {error.strerror or error}") from error

    def copy(self, file: str, target: Path) -> None:
        """Copy a file as it is at one moment, also during writing; the copy is one plain file.

        Raises:
            NotFoundError: there is no such file.
            DamagedError: the file's own structure is damaged.
            StoreError: the file cannot be read or the copy not written.
        """
        with self._reader(file, file, "copied") as reader, closing(sqlite3.connect(target)) as copy:
            # All pages in one step: one read transaction, for which a writer does not wait.
            reader.backup(copy)
            copy.execute("PRAGMA journal_mode = DELETE")

    def finish(self, file: str) -> None:
        """Close a file after the last record; it is then one plain file without a journal beside it."""
        with self._lock:
            writer = self._writers.pop(file, None)
            if writer is not None:
                # Without its journal the file can be read from a read-only medium. While another process reads the
                # file this is refused, and it stays complete, with the journal beside it.
                with suppress(sqlite3.OperationalError):
                    writer.execute("PRAGMA journal_mode = DELETE")
                writer.close()

    def discard(self, file: str) -> None:
        """Remove the file of a run that was never stored."""
        self.finish(file)
        self._path(file).unlink(missing_ok=True)

    def close(self) -> None:
        """Close all files."""
        for file in list(self._writers):
            self.finish(file)

    def _path(self, file: str) -> Path:
        if Path(file).name != file:
            raise StoreError(f"{file!r} is not the name of a waveform file")
        return self._folder / file

    def _writer(self, file: str) -> sqlite3.Connection:
        if file not in self._writers:
            path = self._path(file)
            self._folder.mkdir(parents=True, exist_ok=True)
            self._writers[file] = _open_for_writing(path, self._limits.lock)
        return self._writers[file]

    @contextmanager
    def _reader(self, file: str, what: str, done: str = "read") -> Iterator[sqlite3.Connection]:
        path = self._path(file)
        if not path.is_file():
            raise NotFoundError(f"waveform file {file} is not in {self._folder}; was the folder moved?")
        with _explained(path.with_name(what), done):
            _undo_unfinished_change(path, self._limits.lock)
            reader = _connected(path, "ro", self._limits.lock)
            # The checksum finds damaged text; without this, one damaged text would prevent reading the whole file.
            reader.text_factory = lambda text: text.decode(errors="replace")
            try:
                yield reader
            finally:
                reader.close()


def _add(writer: sqlite3.Connection, row: Encoded) -> int:
    number = writer.execute("INSERT INTO records (header, samples, crc) VALUES (?, ?, ?)", row).lastrowid
    assert number is not None, "an INSERT gives a number"
    return number


def _same(writer: sqlite3.Connection, row: Encoded, after: int) -> int | None:
    """Number of the first record after `after` that is `row`."""
    query = "SELECT number FROM records WHERE number > ? AND header = ? AND samples = ? AND crc = ? ORDER BY number"
    found = writer.execute(f"{query} LIMIT 1", (after, *row)).fetchone()
    return None if found is None else int(found[0])


def _record(reader: sqlite3.Connection, reference: WaveformReference) -> Waveform:
    query = "SELECT header, samples, crc FROM records WHERE number = ?"
    row = reader.execute(query, (reference.record,)).fetchone()
    if row is None:
        raise NotFoundError(f"waveform file {reference.file} has no record {reference.record}")
    header, samples, crc = row
    return decode(header, samples, crc, f"waveform file {reference}")


def _damage(reader: sqlite3.Connection, reference: WaveformReference) -> DamagedError | None:
    try:
        _record(reader, reference)
    except DamagedError as error:
        return error
    except (sqlite3.Error, NotFoundError, UnicodeDecodeError) as error:
        return DamagedError(f"waveform file {reference}", f"the record cannot be read ({error})")
    return None


def _connected(path: Path, mode: str, patience: float) -> sqlite3.Connection:
    return sqlite3.connect(f"{path.resolve().as_uri()}?mode={mode}", uri=True, timeout=seconds_left(patience))


def _undo_unfinished_change(path: Path, patience: float) -> None:
    """Undo an unfinished change by a process that was killed while it opened or finished the file.

    A reader may not undo it.
    """
    # Only such a change has this journal; records go through the write-ahead log.
    if path.with_name(f"{path.name}-journal").exists():
        with closing(_connected(path, "rw", patience)) as writer:
            writer.execute("PRAGMA schema_version").close()


def _open_for_writing(path: Path, patience: float) -> sqlite3.Connection:
    writer = sqlite3.connect(path, isolation_level=None, check_same_thread=False, timeout=patience)
    try:
        prepare_sqlite(writer, patience)
        if writer.execute("SELECT count(*) FROM sqlite_master").fetchone() == (0,):
            writer.executescript(f"BEGIN IMMEDIATE;{_SCHEMA}COMMIT;")
    except sqlite3.Error:
        writer.close()
        raise
    return writer


@contextmanager
def _explained(path: Path, done: str) -> Iterator[None]:
    """Turn errors of SQLite and of the file system into errors of the store."""
    try:
        yield
    except sqlite3.DatabaseError as error:
        if isinstance(error, sqlite3.OperationalError):
            raise StoreError(f"waveform file {path} cannot be {done}: {driver_message(error)}") from error
        raise DamagedError(f"waveform file {path}", f"it is damaged ({error})") from error
    except UnicodeDecodeError as error:  # in SQLite's message about a damaged schema
        raise DamagedError(f"waveform file {path}", "its structure is damaged") from error
    except OSError as error:
        raise StoreError(f"waveform file {path} cannot be {done}: {error}") from error
