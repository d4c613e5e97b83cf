"""The datasets of a Universal File Format file as pyuff reads them, checked to be whole."""

import re
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pyuff

from store.errors import StoreError

AXES = {1: "x", 2: "y", 3: "z", 4: "rx", 5: "ry", 6: "rz"}
"""Directions by their number in a file."""
# How pyuff finds the delimiters of a dataset: in a binary file they follow the data without a new line.
_DELIMITER = re.compile(rb"    -1(?=[\r\n]|\Z| {74})")
_BINARY = re.compile(rb"^    58[bB]", re.MULTILINE)


def _without_quirks(content: bytes) -> bytes:
    """Text without blanks at the ends of lines and without Fortran's exponent D, which stop pyuff; binary as it is."""
    if _BINARY.search(content):
        return content
    lines = (line.rstrip() for line in content.splitlines())
    return b"\n".join(re.sub(rb"(\d)[Dd]([+-]\d)", rb"\1E\2", line) for line in lines) + b"\n"


def read_datasets(path: Path, wanted: tuple[int, ...]) -> list[dict[str, Any]]:
    """The datasets of a file: functions (58), units (164) and the types `wanted` whole, of others the type alone.

    Raises StoreError if the file cannot be read, is no UFF, or is cut short or damaged.
    """
    name = path.name
    try:
        content = path.read_bytes()
    except OSError as error:
        raise StoreError(f"{name} cannot be read: {error.strerror or error}") from error
    content = _without_quirks(content)
    delimiters = len(_DELIMITER.findall(content))
    if delimiters == 0:
        raise StoreError(f"{name} is not a UFF file: it has no dataset between lines of -1")
    if delimiters % 2:
        raise StoreError(f"{name} is cut short: its last dataset has no end")
    with TemporaryDirectory() as folder:
        whole = Path(folder) / "file.unv"
        whole.write_bytes(content)
        try:
            file = pyuff.UFF(str(whole))
            if int(file.get_n_sets()) != delimiters // 2:
                raise StoreError(f"{name} is damaged: {delimiters // 2} datasets begin, {file.get_n_sets()} are whole")
            return [_dataset(file, index, int(kind), wanted) for index, kind in enumerate(file.get_set_types())]
        except StoreError:
            raise
        except Exception as error:
            # pyuff raises bare Exception, and any error of its parser.
            raise StoreError(f"{name} is damaged or not a UFF file: {str(error) or type(error).__name__}") from error


def _dataset(file: Any, index: int, kind: int, wanted: tuple[int, ...]) -> dict[str, Any]:
    if kind in (58, 164):
        return dict(file.read_sets(index))
    try:
        return dict(file.read_sets(index)) if kind in wanted else {"type": kind}
    except Exception:  # noqa: BLE001  pyuff raises it bare; the caller tells that this one is passed over or wrong
        return {"type": kind}
