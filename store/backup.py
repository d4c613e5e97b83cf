"""A consistent copy of a catalogue and its waveforms, made while a run is on.

Why it is consistent: a record is safe in its waveform file before the row that refers to it is written, and is never
changed or deleted. So the catalogue is copied first, as it is at one moment, and the waveform files afterwards: each
then holds at least the records that the copied rows refer to. Records that came in between are in the copy without
a row, as a program that is cut off between record and row leaves them, and do no harm. Neither copy makes a writer
wait: both are single read transactions.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
import zipfile
from contextlib import closing
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from sqlalchemy import Connection

from store import postgresql_programs
from store.backup_layout import CATALOGUES, MANIFEST, WAVEFORMS, Manifest, content_of
from store.catalogue import Catalogue
from store.check import Claim, Finding, check_file, claims
from store.database_messages import in_words
from store.errors import DamagedError, NotFoundError, StoreError
from store.migrate import current_revision
from store.progress import Progress, silent
from store.version import software_version
from store.waveforms import WaveformFolder


@dataclass(frozen=True)
class Backup:
    """What was backed up; `findings` is damage that was there already and is copied as it is."""

    runs: int
    waveform_files: int
    size: int
    findings: tuple[Finding, ...]


def back_up(catalogue: Catalogue, path: Path, progress: Progress = silent) -> Backup:
    """Copy everything that was acknowledged before this began to a new folder, or a new file that ends in .zip.

    The path is there when the backup is complete, and not before.

    Raises:
        StoreError: the path is taken or cannot be written, the catalogue cannot be read, or pg_dump is not there.
    """
    if path.exists():
        raise StoreError(f"{path} exists already; name a new folder or zip file")
    unfinished = path.with_name(path.name + ".unfinished")
    try:
        unfinished.mkdir()
    except FileExistsError as error:
        raise StoreError(
            f"{unfinished} is there: another backup is being made, or one was cut off; if none is being made, remove it"
        ) from error
    except OSError as error:
        raise StoreError(f"{unfinished} cannot be made: {error.strerror or error}") from error
    try:
        content = unfinished / "content"
        backup = _fill(catalogue, content, progress)
        made = _packed(content, unfinished / "archive.zip", progress) if path.suffix == ".zip" else content
        made.rename(path)
        _synchronise(path.parent)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error
    except sqlite3.Error as error:
        raise StoreError(f"{path} cannot be written: {in_words(error)}") from error
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)
    return backup


def _fill(catalogue: Catalogue, folder: Path, progress: Progress) -> Backup:
    (folder / WAVEFORMS).mkdir(parents=True)
    made_at = datetime.now(UTC).isoformat(timespec="seconds")
    with catalogue.reading() as session:
        claimed = claims(session)
        connection = session.connection()
        database, revision = connection.dialect.name, current_revision(connection) or ""
        _copy_database(connection, folder / CATALOGUES[database])
    findings = _copy_waveforms(catalogue.waveforms, claimed, WaveformFolder(folder / WAVEFORMS), progress)
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    with progress("checksums", len(paths)) as advance:
        files = {}
        for path in paths:
            _synchronise(path)
            files[path.relative_to(folder).as_posix()] = content_of(path)
            advance(1)
    manifest = Manifest(database, revision, software_version(), made_at, files)
    (folder / MANIFEST).write_text(manifest.text(), encoding="utf-8")
    for path in (folder / MANIFEST, folder / WAVEFORMS, folder):
        _synchronise(path)
    size = sum(content.size for content in files.values())
    return Backup(len(claimed), len(manifest.waveform_files), size, tuple(findings))


def _copy_database(connection: Connection, target: Path) -> None:
    if connection.dialect.name == "postgresql":
        postgresql_programs.dump(connection, target)
        return
    source = connection.connection.driver_connection
    assert isinstance(source, sqlite3.Connection)
    with closing(sqlite3.connect(target)) as copy:
        source.backup(copy)
        copy.execute("PRAGMA journal_mode = DELETE")


def _copy_waveforms(
    source: WaveformFolder, claimed: dict[str, Claim], target: WaveformFolder, progress: Progress
) -> list[Finding]:
    found = []
    with progress("waveform files", len(claimed)) as advance:
        for file, claim in sorted(claimed.items()):
            try:
                source.copy(file, target.folder / file)
            except NotFoundError:
                pass  # the run has recorded nothing yet; if rows refer to it, the check below says so
            except DamagedError:
                shutil.copyfile(source.folder / file, target.folder / file)
            # Records that came after the catalogue was copied have no row in it.
            found += check_file(target, file, replace(claim, running=True))
            advance(1)
    return found


def _packed(folder: Path, archive: Path, progress: Progress) -> Path:
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    with (
        zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as packed,
        progress("packing", len(paths)) as advance,
    ):
        for path in paths:
            packed.write(path, path.relative_to(folder).as_posix())
            advance(1)
    _synchronise(archive)
    return archive


def _synchronise(path: Path) -> None:
    """Have the disk keep a file's or folder's content through a power cut."""
    if path.is_dir() and os.name == "nt":
        return  # Windows has no such thing for folders
    descriptor = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
