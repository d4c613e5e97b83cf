"""Files and folders that appear only when they are complete."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from store.errors import StoreError

UNFINISHED = ".unfinished"
"""End of the name of a file that is being written."""


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Where to write a file, which becomes `path` in the end; on an error nothing is left.

    Raises StoreError if it exists already, its folder does not, or it cannot be written.
    """
    if path.exists():
        raise StoreError(f"{path} exists already; name a new file")
    _check_parent(path)
    unfinished = path.with_name(path.name + UNFINISHED)
    try:
        yield unfinished
        os.replace(unfinished, path)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error}") from error
    finally:
        unfinished.unlink(missing_ok=True)


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """A folder to write into, which becomes `path` in the end: a new or empty folder, or a new file that ends in .zip.

    On an error nothing is left, and a folder that was empty is so again. Raises StoreError if it exists already or
    cannot be written.
    """
    if path.exists() and not (path.is_dir() and not any(path.iterdir())):
        raise StoreError(f"{path} exists already; name a new folder or zip file")
    if path.suffix == ".zip":
        _check_parent(path)
    # a program that is killed leaves it beside the result, with a name that tells what it is
    beside = path.parent if path.parent.is_dir() else None
    with TemporaryDirectory(dir=beside, prefix=f"{path.name}.", suffix=UNFINISHED) as scratch:
        folder = Path(scratch) / "content"
        folder.mkdir()
        yield folder
        try:
            if path.suffix == ".zip":
                packed = shutil.make_archive(str(Path(scratch) / "archive"), "zip", folder)
                with new_file(path) as unfinished:
                    shutil.move(packed, unfinished)
            elif path.exists():
                _fill(path, folder)
            else:
                _copy_whole(folder, path)
        except OSError as error:
            raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error


def _fill(path: Path, folder: Path) -> None:
    """Copy what is in `folder` into an empty folder, which may be that of a disk and cannot be replaced."""
    try:
        shutil.copytree(folder, path, dirs_exist_ok=True)
    except BaseException:
        for each in path.iterdir():
            shutil.rmtree(each) if each.is_dir() else each.unlink()
        raise


def _copy_whole(folder: Path, path: Path) -> None:
    unfinished = path.with_name(path.name + UNFINISHED)
    if unfinished.exists():
        shutil.rmtree(unfinished)  # of a program that was killed
    try:
        shutil.copytree(folder, unfinished)
        os.replace(unfinished, path)
    except BaseException:
        shutil.rmtree(unfinished, ignore_errors=True)
        raise


def _check_parent(path: Path) -> None:
    """Say it before the work, and in words; each library that writes files has its own for it."""
    if not path.parent.is_dir():
        raise StoreError(f"{path} cannot be written: there is no folder {path.parent}")


def synchronise(path: Path) -> None:
    """Write a file or folder to the disk, so that it survives a power cut."""
    if path.is_dir() and os.name == "nt":
        return  # Windows has no such thing for folders
    descriptor = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
