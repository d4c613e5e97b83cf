"""Where the values of a table lie in an SQLite file (sqlite.org/fileformat2.html), to damage one of them."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

INTERIOR = 0x05


def value_bytes(path: Path, table: str) -> list[int]:
    """Places in the file of every byte of the values of `table`, and of their types; not of the row's number."""
    with closing(sqlite3.connect(path)) as connection:
        (root,) = connection.execute("SELECT rootpage FROM sqlite_master WHERE name = ?", (table,)).fetchone()
        first = connection.execute(f"PRAGMA table_info({table})").fetchone()[1]
    content = path.read_bytes()
    size = int.from_bytes(content[16:18]) % 65535 or 65536
    return [
        place
        for start, length in _records(content, size, root)
        for place in _values(content, start, length, numbered=first == "id")
    ]


def _records(content: bytes, size: int, page: int) -> Iterator[tuple[int, int]]:
    """Start and length of each record; what lies on further pages is left out."""
    start = (page - 1) * size
    header = start + (100 if page == 1 else 0)
    kind, cells = content[header], int.from_bytes(content[header + 3 : header + 5])
    pointers = header + (12 if kind == INTERIOR else 8)
    for place in range(pointers, pointers + 2 * cells, 2):
        cell = start + int.from_bytes(content[place : place + 2])
        if kind == INTERIOR:
            yield from _records(content, size, int.from_bytes(content[cell : cell + 4]))
            continue
        length, cell = _number(content, cell)
        _, cell = _number(content, cell)
        if length <= size - 35:
            yield cell, length
    if kind == INTERIOR:
        yield from _records(content, size, int.from_bytes(content[header + 8 : header + 12]))


def _values(content: bytes, start: int, length: int, *, numbered: bool) -> Iterator[int]:
    end, place = _number(content, start)
    types = place
    if numbered:  # its type is that of NULL, and SQLite reads neither
        _, types = _number(content, place)
    yield from range(types, start + end)
    yield from range(start + end, start + length)


def _number(content: bytes, place: int) -> tuple[int, int]:
    """A number of variable length, and the place after it."""
    value = 0
    for byte in content[place : place + 9]:
        value, place = value << 7 | byte & 0x7F, place + 1
        if not byte & 0x80:
            break
    return value, place
