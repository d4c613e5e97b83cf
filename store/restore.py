"""Bringing a backup back: into an empty place only, checksums first, and checked as a whole afterwards."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from sqlalchemy import URL, inspect

from store import postgresql_programs
from store.backup_layout import CATALOGUES, WAVEFORMS, Manifest, Source, extract, opened, read_manifest
from store.catalogue import Catalogue
from store.check import Finding, check
from store.database import address_of, explained, make_engine, waveform_folder_of
from store.errors import StoreError
from store.migrate import known_revisions
from store.progress import Progress, silent


@dataclass(frozen=True)
class Restored:
    """What was restored: what the backup says about itself, and what the check of all of it found."""

    manifest: Manifest
    findings: tuple[Finding, ...]


def restore(path: Path, url: str, waveform_folder: Path | None = None, progress: Progress = silent) -> Restored:
    """Restore a backup into a database that is empty, with its waveforms in a folder that is new or empty.

    A backup of an older version is brought up to date. On an error nothing is left behind.

    Args:
        path: what `store.backup.back_up` made, folder or zip.
        url: an SQLite file that is not there yet, or an empty PostgreSQL database.
        waveform_folder: beside an SQLite file by default, required for PostgreSQL.
        progress: told how far it is.

    Raises:
        DamagedError: a file of the backup is not what was backed up.
        StoreError: it is no backup, of the other kind of database or a newer version, or the place is not empty.
    """
    address = address_of(url)
    folder = waveform_folder or waveform_folder_of(address)
    where = f"backup {path}"
    with opened(path) as source:
        manifest = read_manifest(source, where)
        _refuse_unsuitable(manifest, address, where)
        _refuse_taken(address, folder)
        with explained(address), _undone_on_error(folder) as written:
            _extract_waveforms(source, manifest, folder, written, where, progress)
            # The catalogue comes last: while it is not there, nobody takes the waveforms for complete.
            _restore_catalogue(source, manifest, address, where)
    with Catalogue.open(url, folder) as catalogue:
        return Restored(manifest, tuple(check(catalogue, progress)))


def _refuse_unsuitable(manifest: Manifest, address: URL, where: str) -> None:
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


def _refuse_taken(address: URL, folder: Path) -> None:
    if address.get_backend_name() == "sqlite":
        # A journal that was left of another database would be taken for this one's.
        for path in (Path(f"{address.database}{ending}") for ending in ("", "-wal", "-journal")):
            if path.exists():
                raise StoreError(f"{path} exists already; move it away, or configure a database that is not there yet")
    else:
        engine = make_engine(address)
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
def _undone_on_error(folder: Path) -> Iterator[list[Path]]:
    """Collects the files that are written, to remove them and a folder that was made on any error."""
    was_there, written = folder.is_dir(), list[Path]()
    try:
        yield written
    except BaseException as error:
        with suppress(OSError):  # the first error is the one to tell
            for path in written:
                path.unlink(missing_ok=True)
            if not was_there:
                folder.rmdir()
        if isinstance(error, OSError):
            raise StoreError(f"nothing was restored: {error}") from error
        raise


def _extract_waveforms(
    source: Source, manifest: Manifest, folder: Path, written: list[Path], where: str, progress: Progress
) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with progress("waveform files", len(manifest.waveform_files)) as advance:
        for file in manifest.waveform_files:
            written.append(folder / file)
            path = f"{WAVEFORMS}/{file}"
            extract(source, path, manifest.files[path], folder / file, where)
            advance(1)


def _restore_catalogue(source: Source, manifest: Manifest, address: URL, where: str) -> None:
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
    engine = make_engine(address)
    try:
        with TemporaryDirectory() as scratch, engine.connect() as connection:
            extract(source, name, manifest.files[name], Path(scratch) / name, where)
            postgresql_programs.load(connection, Path(scratch) / name)
    finally:
        engine.dispose()
