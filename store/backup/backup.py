"""A consistent copy of a catalogue and its waveforms, also during a run, and its restoration.

A record is safe in its waveform file before the row that refers to it is written, and is never changed or deleted. So
the catalogue is copied first, as it is at one moment, and the waveform files afterwards: each then holds at least the
records that the copied rows refer to. Records that came in between are in the copy without a row, like those of a
program that was interrupted between record and row, and do no harm. Neither copy makes a writer wait: both are single
read transactions.

A backup is restored into an empty place only: checksums first, and a check of the whole afterwards.
"""

import shutil
import sqlite3
import zipfile
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

from sqlalchemy import URL, Connection, inspect

from store.backup import postgresql_programs
from store.backup.backup_layout import (
    CATALOGUES,
    MANIFEST,
    WAVEFORMS,
    BackupPath,
    Manifest,
    content_of,
    extract,
    opened,
    read_manifest,
)
from store.backup.check import Claim, Finding, check, check_file, claims
from store.catalogue import Catalogue
from store.database.connection import address_of, driver_message, explained, make_engine, waveform_folder_of
from store.database.time_limits import DEFAULT_LIMITS
from store.errors import DamagedError, NotFoundError, StoreError
from store.migrate import DEFAULT_RIG, current_revision, known_revisions
from store.new_file import synchronise
from store.progress import Progress, silent
from store.version import software_version
from store.waveforms.folder import WaveformFolder


@dataclass(frozen=True)
class Backup:
    """Size of a backup; `findings` is older damage, which is copied as it is."""

    runs: int
    waveform_files: int
    size: int
    findings: tuple[Finding, ...]


def back_up(catalogue: Catalogue, path: Path, progress: Progress = silent) -> Backup:
    """Copy everything that was stored before to a new folder, or to a new file that ends in .zip.

    The path exists when the backup is complete, and not before. Raises StoreError if the path exists or cannot be
    written, the catalogue cannot be read, or pg_dump is missing.
    """
    if path.exists():
        raise StoreError(f"{path} exists already; name a new folder or zip file")
    unfinished = path.with_name(path.name + ".unfinished")
    try:
        unfinished.mkdir()
    except FileExistsError as error:
        raise StoreError(
            f"{unfinished} exists: another backup is being made, or one was cut off; if none is being made, remove it"
        ) from error
    except OSError as error:
        raise StoreError(f"{unfinished} cannot be made: {error.strerror or error}") from error
    try:
        content = unfinished / "content"
        backup = _fill(catalogue, content, progress)
        made = _packed(content, unfinished / "archive.zip", progress) if path.suffix == ".zip" else content
        made.rename(path)
        synchronise(path.parent)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error
    except sqlite3.Error as error:
        raise StoreError(f"{path} cannot be written: {driver_message(error)}") from error
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)
    return backup


def _fill(catalogue: Catalogue, folder: Path, progress: Progress) -> Backup:
    (folder / WAVEFORMS).mkdir(parents=True)
    made_at = datetime.now(UTC).isoformat(timespec="seconds")
    with catalogue.reading(long=True) as session:
        claimed = claims(session)
        connection = session.connection()
        database, revision = connection.dialect.name, current_revision(connection) or ""
        _copy_database(connection, folder / CATALOGUES[database])
    findings = _copy_waveforms(catalogue.waveforms, claimed, WaveformFolder(folder / WAVEFORMS), progress)
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    with progress("checksums", len(paths)) as advance:
        files = {}
        for path in paths:
            synchronise(path)
            files[path.relative_to(folder).as_posix()] = content_of(path)
            advance(1)
    manifest = Manifest(database, revision, software_version(), made_at, files)
    (folder / MANIFEST).write_text(manifest.text(), encoding="utf-8")
    for path in (folder / MANIFEST, folder / WAVEFORMS, folder):
        synchronise(path)
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
    synchronise(archive)
    return archive


@dataclass(frozen=True)
class Restored:
    """The manifest of a restored backup, and the findings of the check afterwards."""

    manifest: Manifest
    findings: tuple[Finding, ...]


def restore(
    path: Path, url: str, waveform_folder: Path | None = None, progress: Progress = silent, rig: str = DEFAULT_RIG
) -> Restored:
    """Restore a backup into a database that is empty, with its waveforms in a folder that is new or empty.

    A backup of an older version is updated. Where the copy fails, everything is removed again. Where the update or the
    check fails, the restored files stay; remove them before another attempt.

    Args:
        path: a backup by `back_up`, folder or zip.
        url: an SQLite file that does not exist yet, or an empty PostgreSQL database.
        waveform_folder: beside an SQLite file by default, required for PostgreSQL.
        progress: of files and tables.
        rig: to which the runs of an older backup belong, from before rigs had names.

    Raises:
        DamagedError: a file of the backup is damaged.
        StoreError: it is no backup, of the other kind of database or a newer version, or the target is not empty.
    """
    address = address_of(url)
    folder = waveform_folder or waveform_folder_of(address)
    where = f"backup {path}"
    with opened(path) as source:
        manifest = read_manifest(source, where)
        _check_suitable(manifest, address, where)
        _check_empty(address, folder)
        with explained(address), _removed_on_error(folder) as written:
            _extract_waveforms(source, manifest, folder, written, where, progress)
            # The catalogue comes last: without it the waveforms do not look complete.
            _restore_catalogue(source, manifest, address, where)
    with Catalogue.open(url, folder, rig=rig) as catalogue:
        return Restored(manifest, tuple(check(catalogue, progress)))


def _check_suitable(manifest: Manifest, address: URL, where: str) -> None:
    database = address.get_backend_name()
    if manifest.database != database:
        raise StoreError(f"{where} is of {manifest.database}, the configured database is {database}; configure one")
    if manifest.revision not in known_revisions():
        raise StoreError(
            f"{where} is of schema revision {manifest.revision}, made by jointlab {manifest.software_version}, which "
            "this version does not know; update jointlab"
        )
    if CATALOGUES[database] not in manifest.files:
        raise StoreError(f"{where} holds no {CATALOGUES[database]}")


def _check_empty(address: URL, folder: Path) -> None:
    if address.get_backend_name() == "sqlite":
        # A journal left by another database would be taken for this one's.
        for path in (Path(f"{address.database}{ending}") for ending in ("", "-wal", "-journal")):
            if path.exists():
                raise StoreError(f"{path} exists already; move it away, or configure a database that is not there yet")
    else:
        engine = make_engine(address, DEFAULT_LIMITS)
        try:
            with explained(address), engine.connect() as connection:
                tables = inspect(connection).get_table_names()
        finally:
            engine.dispose()
        if tables:
            shown = address.render_as_string(hide_password=True)
            raise StoreError(f"{shown} is not empty: it holds {len(tables)} tables; make a new one with createdb")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise StoreError(f"{folder} is not an empty folder; move away what is there, such as of a restore cut off")


@contextmanager
def _removed_on_error(folder: Path) -> Iterator[list[Path]]:
    """Collects the written files; on any error removes them, and the folder if it is new."""
    was_there, written = folder.is_dir(), list[Path]()
    try:
        yield written
    except BaseException as error:
        with suppress(OSError):  # the first error is reported
            for path in written:
                path.unlink(missing_ok=True)
            if not was_there:
                folder.rmdir()
        if isinstance(error, OSError):
            raise StoreError(f"nothing was restored: {error}") from error
        raise


def _extract_waveforms(
    source: BackupPath, manifest: Manifest, folder: Path, written: list[Path], where: str, progress: Progress
) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with progress("waveform files", len(manifest.waveform_files)) as advance:
        for file in manifest.waveform_files:
            written.append(folder / file)
            path = f"{WAVEFORMS}/{file}"
            extract(source, path, manifest.files[path], folder / file, where)
            advance(1)


def _restore_catalogue(source: BackupPath, manifest: Manifest, address: URL, where: str) -> None:
    name = CATALOGUES[manifest.database]
    if manifest.database == "sqlite":
        database = Path(str(address.database))
        unfinished = database.with_name(database.name + ".unfinished")
        try:
            extract(source, name, manifest.files[name], unfinished, where)
            unfinished.rename(database)
        finally:
            unfinished.unlink(missing_ok=True)
        return
    engine = make_engine(address, DEFAULT_LIMITS)
    try:
        with TemporaryDirectory() as scratch, engine.connect() as connection:
            extract(source, name, manifest.files[name], Path(scratch) / name, where)
            postgresql_programs.load(connection, Path(scratch) / name)
    finally:
        engine.dispose()
