"""The folder of waveforms: one append-only file per run, each an SQLite database of checked records.

Why SQLite files beside the catalogue: docs/decisions/0002-waveforms-beside-the-catalogue.md.
"""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from store.errors import DamagedError, NotFoundError, StoreError
from store.waveform import Waveform, WaveformReference
from store.waveform_codec import check_storable, decode, encode

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

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._writers: dict[str, sqlite3.Connection] = {}
        self._lock = threading.Lock()

    @property
    def folder(self) -> Path:
        """Where the files are."""
        return self._folder

    def append(self, file: str, waveform: Waveform) -> WaveformReference:
        """Add a record to a run's file; when this returns, the record survives a power cut.

        Raises:
            StoreError: the file cannot be written.
        """
        return self.append_all(file, [waveform])[0]

    def append_all(self, file: str, waveforms: Sequence[Waveform]) -> list[WaveformReference]:
        """Add several records in one commit: all of them or none.

        Raises:
            StoreError: the file cannot be written.
        """
        rows = []
        for waveform in waveforms:
            check_storable(waveform)
            rows.append(encode(waveform))
        path = self._path(file)
        with self._lock, _explained(path, "written"):
            writer = self._writer(file)
            with writer:
                writer.execute("BEGIN IMMEDIATE")
                numbers = [
                    writer.execute("INSERT INTO records (header, samples, crc) VALUES (?, ?, ?)", row).lastrowid
                    for row in rows
                ]
        return [WaveformReference(file, int(number)) for number in numbers if number is not None]

    def read(self, reference: WaveformReference) -> Waveform:
        """A record, verified against its checksum.

        Raises:
            NotFoundError: there is no such file or record.
            DamagedError: the record is not what was written.
        """
        with self._reader(reference.file, str(reference)) as reader:
            row = reader.execute(
                "SELECT header, samples, crc FROM records WHERE number = ?", (reference.record,)
            ).fetchone()
        if row is None:
            raise NotFoundError(f"waveform file {reference.file} has no record {reference.record}")
        header, samples, crc = row
        return decode(header, samples, crc, f"waveform file {reference}")

    def records(self, file: str) -> list[WaveformReference]:
        """Every record of a file, in the order of writing.

        Raises:
            NotFoundError: there is no such file.
        """
        with self._reader(file, file) as reader:
            numbers = reader.execute("SELECT number FROM records ORDER BY number").fetchall()
        return [WaveformReference(file, number) for (number,) in numbers]

    def damage(self, file: str) -> list[str]:
        """One line for each damaged record of a file; empty where all is well."""
        found = []
        try:
            references = self.records(file)
        except StoreError as error:
            return [str(error)]
        for reference in references:
            try:
                self.read(reference)
            except DamagedError as error:
                found.append(str(error))
        return found

    def finish(self, file: str) -> None:
        """Close a file that is not written any more; it is then one plain file without a journal beside it."""
        with self._lock:
            writer = self._writers.pop(file, None)
            if writer is not None:
                # Without its journal the file can be read from a read-only medium. While a reader is in
                # the file this is refused, and it stays as it is: complete, with the journal beside it.
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
            self._writers[file] = _open_for_writing(path)
        return self._writers[file]

    @contextmanager
    def _reader(self, file: str, what: str) -> Iterator[sqlite3.Connection]:
        path = self._path(file)
        if not path.is_file():
            raise NotFoundError(f"waveform file {file} is not in {self._folder}; was the folder moved?")
        with _explained(path.with_name(what), "read"):
            reader = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True, timeout=10.0)
            try:
                yield reader
            finally:
                reader.close()


def _open_for_writing(path: Path) -> sqlite3.Connection:
    writer = sqlite3.connect(path, isolation_level=None, check_same_thread=False, timeout=10.0)
    try:
        writer.execute("PRAGMA journal_mode = WAL")
        writer.execute("PRAGMA synchronous = FULL")
        if writer.execute("SELECT count(*) FROM sqlite_master").fetchone() == (0,):
            writer.executescript(f"BEGIN IMMEDIATE;{_SCHEMA}COMMIT;")
    except sqlite3.Error:
        writer.close()
        raise
    return writer


@contextmanager
def _explained(path: Path, done: str) -> Iterator[None]:
    """Turn what SQLite and the file system say into errors of the store."""
    try:
        yield
    except sqlite3.DatabaseError as error:
        if isinstance(error, sqlite3.OperationalError):
            raise StoreError(f"waveform file {path} cannot be {done}: {error}") from error
        raise DamagedError(f"waveform file {path} is damaged: {error}; restore it from a backup") from error
    except OSError as error:
        raise StoreError(f"waveform file {path} cannot be {done}: {error}") from error
