"""The datasets of a Universal File Format file: split here, as whole as the file says, and read by pyuff one by one."""

import re
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pyuff

from store.errors import StoreError

AXES = {1: "x", 2: "y", 3: "z", 4: "rx", 5: "ry", 6: "rz"}
"""Directions by their number in a file."""
UNREADABLE = "unreadable"
"""Key of a dataset that pyuff could not read: the reason."""
# A line of its own, with or without blanks after it.
_DELIMITER = re.compile(rb"(?:(?<=[\r\n])|\A)    -1[ \t]*(?:\r\n|[\r\n]|\Z)")
# After binary data it follows without a new line.
_AFTER_BINARY = re.compile(rb"\s*    -1[ \t]*(?:\r\n|[\r\n]|\Z)")
_BINARY = re.compile(rb"    58[bB]")
_ASCII_LINES = 12
"""Lines before the data of a binary dataset, with that of its type."""
_LONGEST_LINE = 200
"""Bytes; lines have 80 columns."""


def read_datasets(path: Path, wanted: tuple[int, ...]) -> list[dict[str, Any]]:
    """The datasets of a file: functions (58), units (164) and the types `wanted` whole, of others the type alone.

    A dataset of a type that is wanted, but could not be read, has its type and the reason, `UNREADABLE`.

    Raises StoreError if the file cannot be read, is no UFF, or is cut short or damaged.
    """
    name = path.name or str(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise StoreError(f"{name} cannot be read: {error.strerror or error}") from error
    datasets = list(_split(content, name))
    if not datasets:
        raise StoreError(f"{name} is not a UFF file: it has no dataset between lines of -1")
    with TemporaryDirectory() as folder:
        return [
            _dataset(Path(folder) / "dataset.unv", dataset, wanted, f"{name}, dataset {number}")
            for number, dataset in enumerate(datasets, start=1)
        ]


def _split(content: bytes, name: str) -> Iterator[bytes]:
    """Each dataset without its delimiters; text without the quirks that stop pyuff."""
    begin = _DELIMITER.search(content)
    while begin is not None:
        start = begin.end()
        if _BINARY.match(content, start):
            data = _after_lines(content, start)
            end = _AFTER_BINARY.match(content, data + _count(content[start:])) or _AFTER_BINARY.search(content, data)
        else:
            end = _DELIMITER.search(content, start)
        if end is None:
            raise StoreError(f"{name} is cut short: its last dataset has no end")
        dataset = content[start : end.start()]
        yield dataset if _BINARY.match(dataset) else _without_quirks(dataset)
        begin = _DELIMITER.search(content, end.end())


def _after_lines(content: bytes, start: int) -> int:
    """Where the data of a binary dataset begin, whose lines begin at `start`."""
    for line in content[start : start + _ASCII_LINES * _LONGEST_LINE].splitlines(keepends=True)[:_ASCII_LINES]:
        start += len(line)
    return start


def _count(dataset: bytes) -> int:
    """The number of bytes that a binary dataset states for its data; some programs count wrongly. Zero for none."""
    stated = dataset.split(b"\n", 1)[0][31:43].strip()
    return int(stated) if stated.isdigit() else 0


def _without_quirks(text: bytes) -> bytes:
    """Text without blanks at the ends of lines and without Fortran's exponent D.

    A line that ends with -1, such as a color, gets a blank: pyuff takes it for the end of the dataset.
    """
    lines = (re.sub(rb"(\d)[Dd]([+-]\d)", rb"\1E\2", line.rstrip()) for line in text.splitlines())
    return b"".join(line + (b" \n" if line.endswith(b"    -1") else b"\n") for line in lines)


def _dataset(file: Path, dataset: bytes, wanted: tuple[int, ...], where: str) -> dict[str, Any]:
    stated = dataset[:6].strip()
    if not stated.isdigit():
        raise StoreError(f"{where} has no type in its first line; the file is damaged or not a UFF file")
    kind = int(stated)
    if kind not in (58, 164, *wanted):
        return {"type": kind}
    file.write_bytes(b"    -1\n" + dataset + b"    -1\n")
    try:
        return dict(pyuff.UFF(str(file)).read_sets(0))
    except Exception as error:  # pyuff raises bare Exception, and any error of its parser
        reason = str(error) or type(error).__name__
        if kind in (58, 164):
            raise StoreError(f"{where} is damaged or not a UFF file: {reason}") from error
        return {"type": kind, UNREADABLE: reason}
