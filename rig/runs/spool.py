"""The spool: what a run writes to the local disk while it is carried out, and what is read back to store it.

A spool is a folder for one carrying out of a run, in the folder of spools of its rig. Its file `records` has the order
in frame 0 and a record in each further frame (`rig/runs/spool_file.py`). No database is needed to write it, and none
can delay it. `jointlab/runs/ingest.py` stores what it holds and removes it.
"""

import os
import re
import shutil
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from uuid import uuid4

from pydantic import TypeAdapter, ValidationError

from rig.runs.records import EndRecord, Record, RunOrder, RunRecords
from rig.runs.spool_file import FrameWriter, SpoolFrame, read_frames
from store.database.file_lock import LockHeldError, exclusive_lock
from store.errors import StoreError
from store.new_file import synchronise
from store.waveforms.waveform import Waveform
from store.waveforms.waveform_codec import Encoded, encode

RECORDS, RESERVE, LOCK = "records", "reserve", ".lock"
DAMAGED, REFUSED = ".damaged", ".refused"
"""Endings of spools that are set aside: what is after the damage, or from the refused record on, is not stored."""
FREE_TO_BEGIN = 200_000_000
"""Bytes that have to be free before a run begins: a sweep of some hundred points."""
FREE_TO_GO_ON = 20_000_000
"""Bytes that have to be free before the next blow or sine point is written; usual records are far smaller."""
RESERVED = 65_536
"""Bytes that a spool keeps for its last record, which says why the run ended, on a disk that others have filled."""
_LENGTHS = struct.Struct("<III")
_PART = re.compile(r"-part(\d+)-")
_orders = TypeAdapter(RunOrder)
_records: TypeAdapter[Record] = TypeAdapter(Record)


class SpoolError(StoreError):
    """The spool cannot be written or read; everything that was written before is in it."""


@dataclass(frozen=True)
class Spooled:
    """One record of a spool.

    Attributes:
        number: counts from 1.
        waveform: as it is stored; None for a record without one.
    """

    number: int
    record: Record
    waveform: Encoded | None


class Spool(RunRecords):
    """The spool of one run that is carried out; `spooling` opens one.

    Args:
        path: its folder, which does not exist yet.

    Raises SpoolError where it cannot be made.
    """

    def __init__(self, path: Path, order: RunOrder) -> None:
        self._path = path
        with self._explained():
            path.mkdir(parents=True)
            self._require(FREE_TO_BEGIN)
            (path / RESERVE).write_bytes(os.urandom(RESERVED))  # which no file system compresses
            self._file = FrameWriter(path / RECORDS)
            try:
                self._file.append(_orders.dump_json(order))
                synchronise(path)
                synchronise(path.parent)
            except BaseException:
                self._file.close()
                raise

    def write(self, record: Record, waveform: Waveform | None = None) -> None:
        """Append a record; it survives a power cut then.

        Raises SpoolError where the disk is full or fails; the end of a run has room that was kept for it.
        """
        with self._explained():
            if isinstance(record, EndRecord):
                (self._path / RESERVE).unlink(missing_ok=True)
            else:
                self._require(FREE_TO_GO_ON)
            self._file.append(_content(record, None if waveform is None else encode(waveform)))

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _require(self, free: int) -> None:
        found = shutil.disk_usage(self._path).free
        if found < free:
            raise SpoolError(
                f"the disk of {self._path.parent} is full: {found / 1e6:.0f} MB are free, {free / 1e6:.0f} MB are "
                "needed; make room, then resume the run"
            )

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            why = error.strerror or error
            raise SpoolError(f"{self._path} cannot be written: {why}; repair or empty the disk, then resume") from error


@contextmanager
def spooling(folder: Path, order: RunOrder) -> Iterator[Spool]:
    """A new spool for `order` in the folder of spools, written by this process while the context lasts.

    Raises SpoolError where it cannot be made.
    """
    part = 1 + max((_part(each) for each in folder.glob(f"{Path(order.waveform_file).stem}-*")), default=0)
    path = folder / f"{Path(order.waveform_file).stem}-part{part:04d}-{uuid4().hex[:8]}"
    with exclusive_lock(_lock_of(path)):
        try:
            spool = Spool(path, order)
        except SpoolError:
            discard_spool(path)
            raise
        try:
            yield spool
        finally:
            spool.close()


class SpoolReader:
    """Reads the spool in folder `path`, also while it is written; `order` is known once a record was read."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.order: RunOrder | None = None
        self._last: SpoolFrame | None = None

    def records(self) -> Iterator[Spooled]:
        """The records after those that were read before.

        Raises SpoolDamagedError where the spool is damaged, SpoolError where it cannot be read.
        """
        try:
            for frame in read_frames(self.path / RECORDS, self._last):
                if frame.number == 0:
                    self.order = _orders.validate_json(frame.content)
                else:
                    yield _spooled(frame.number, frame.content)
                self._last = frame
        except OSError as error:
            raise SpoolError(f"{self.path} cannot be read: {error.strerror or error}") from error
        except ValidationError as error:
            raise SpoolError(f"{self.path} was written by another version; store it with that one") from error


def spools(folder: Path) -> list[Path]:
    """The spools in the folder that are not set aside; those of a run in the order in which they were made."""
    found = (path.parent for path in folder.glob(f"*/{RECORDS}"))
    return sorted(
        (path for path in found if path.suffix not in (DAMAGED, REFUSED)), key=lambda path: (_part(path), path.name)
    )


def spools_of(folder: Path, waveform_file: str) -> list[Path]:
    """The spools of the run with this file of waveforms, as `spools`."""
    return [path for path in spools(folder) if path.name.startswith(f"{Path(waveform_file).stem}-")]


def is_written(path: Path) -> bool:
    """Whether a living process writes the spool."""
    try:
        with exclusive_lock(_lock_of(path)):
            return False
    except LockHeldError:
        return True


def discard_spool(path: Path) -> None:
    """Remove a spool whose records are all stored, or that has none."""
    (path / RECORDS).unlink(missing_ok=True)  # first: a folder without it is no spool
    shutil.rmtree(path, ignore_errors=True)
    _lock_of(path).unlink(missing_ok=True)


def set_aside(path: Path, ending: str) -> None:
    """Keep a spool unchanged under another name, `DAMAGED` or `REFUSED`, out of the way of others."""
    path.rename(path.with_name(path.name + ending))
    _lock_of(path).unlink(missing_ok=True)


def _part(path: Path) -> int:
    """Which part of its run a spool is, from 1; 0 for those of earlier versions."""
    found = _PART.search(path.name)
    return int(found[1]) if found else 0


def _lock_of(path: Path) -> Path:
    return path.with_name(path.name + LOCK)


def _content(record: Record, waveform: Encoded | None) -> bytes:
    plain = _records.dump_json(record)
    header, samples, checksum = ("", b"", 0) if waveform is None else waveform
    head = header.encode()
    return _LENGTHS.pack(len(plain), len(head), checksum) + plain + head + samples


def _spooled(number: int, content: bytes) -> Spooled:
    plain, head, checksum = _LENGTHS.unpack_from(content)
    at = _LENGTHS.size
    record = _records.validate_json(content[at : at + plain])
    header, samples = content[at + plain : at + plain + head], content[at + plain + head :]
    return Spooled(number, record, (header.decode(), samples, checksum) if head else None)
