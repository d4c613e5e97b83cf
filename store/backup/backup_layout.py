"""The files of a backup: a manifest with checksums, the copy of the catalogue, and the waveforms.

backup.json                       time, version, schema revision; size and SHA-256 of every file
catalogue.sqlite | catalogue.dump the SQLite file, or the output of pg_dump (custom format)
waveforms/<file>                  one for each run with records
"""

import hashlib
import json
import os
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO

from store.errors import DamagedError, StoreError

FORMAT = "jointlab-backup/1"
MANIFEST = "backup.json"
WAVEFORMS = "waveforms"
# By SQLAlchemy's name of the database.
CATALOGUES = {"sqlite": "catalogue.sqlite", "postgresql": "catalogue.dump"}
_CHUNK = 1 << 20

# A folder, or the root of a zip: both open their files alike.
BackupPath = Path | zipfile.Path


@dataclass(frozen=True)
class Content:
    """Size in bytes and SHA-256 of one file of a backup."""

    size: int
    sha256: str


@dataclass(frozen=True)
class Manifest:
    """The description of a backup.

    Attributes:
        database: sqlite or postgresql.
        revision: of the schema.
        made_at: UTC, ISO 8601, of the state that the backup holds.
        files: by path within the backup.
    """

    database: str
    revision: str
    software_version: str
    made_at: str
    files: dict[str, Content]

    @property
    def waveform_files(self) -> list[str]:
        """Names of the waveform files."""
        return [path.removeprefix(f"{WAVEFORMS}/") for path in self.files if path.startswith(f"{WAVEFORMS}/")]

    def text(self) -> str:
        """The manifest as `read_manifest` understands it."""
        return json.dumps({"format": FORMAT, **asdict(self)}, indent=1) + "\n"


@contextmanager
def opened(path: Path) -> Iterator[BackupPath]:
    """A backup, folder or zip; StoreError if it is missing, or neither of both."""
    if path.is_dir():
        yield path
        return
    try:
        archive = zipfile.ZipFile(path)
    except (OSError, zipfile.BadZipFile) as error:
        raise StoreError(f"backup {path} cannot be read: {error}") from error
    with archive:
        yield zipfile.Path(archive)


def read_manifest(source: BackupPath, where: str) -> Manifest:
    """The manifest of a backup; StoreError if it is no backup, or of another format."""
    try:
        document = json.loads((source / MANIFEST).read_text(encoding="utf-8"))
        if document.pop("format") != FORMAT:
            raise StoreError(f"{where}: {MANIFEST} is not of format {FORMAT}")
        files = {path: Content(**content) for path, content in document.pop("files").items()}
        manifest = Manifest(**document, files=files)
    except (OSError, KeyError, zipfile.BadZipFile) as error:
        raise StoreError(f"{where} is no backup: it has no {MANIFEST} that can be read") from error
    except (ValueError, TypeError, AttributeError) as error:
        raise DamagedError(f"{where}: {MANIFEST}", f"cannot be understood ({error})") from error
    for path in manifest.files:
        parts = path.split("/")
        if len(parts) > 2 or any(part in ("", ".", "..") for part in parts):
            raise StoreError(f"{where}: {path!r} is not the path of a file in a backup")
    return manifest


def content_of(path: Path) -> Content:
    """Size and checksum of a file."""
    with path.open("rb") as file:
        return _copy(file, None)


def extract(source: BackupPath, path: str, expected: Content, target: Path, where: str) -> None:
    """Write one file of a backup to `target`, and verify its checksum.

    Raises DamagedError if size or checksum differ, or it cannot be unpacked; StoreError if the backup does not hold it,
    or the target cannot be written.
    """
    try:
        with (source / path).open("rb") as packed, target.open("xb") as written:
            found = _copy(packed, written)
            written.flush()
            os.fsync(written.fileno())
    except (zipfile.BadZipFile, zlib.error, EOFError, KeyError, FileNotFoundError) as error:
        raise DamagedError(f"{where}: {path}", f"cannot be unpacked ({error})") from error
    if found != expected:
        raise DamagedError(f"{where}: {path}", "its checksum differs")


def _copy(source: IO[bytes], target: IO[bytes] | None) -> Content:
    digest, size = hashlib.sha256(), 0
    while chunk := source.read(_CHUNK):
        digest.update(chunk)
        size += len(chunk)
        if target is not None:
            target.write(chunk)
    return Content(size, digest.hexdigest())
