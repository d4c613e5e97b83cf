"""Checksums over rows, and the hash chain of the audit log: over values as SQLite has them, the same on both databases.

The text under a hash is the row as JSON: its columns by name, without the row's own number, the hash, and columns that
are NULL. So a later column that may be NULL leaves older hashes valid. A document counts as the text that is stored.
"""

import hashlib
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, date, datetime
from functools import cache
from operator import index
from typing import Any

from sqlalchemy import (
    JSON,
    Boolean,
    Column,
    ColumnClause,
    ColumnElement,
    Connection,
    Double,
    Integer,
    Row,
    Table,
    Text,
    TypeDecorator,
    cast,
    literal_column,
    select,
    tuple_,
)

from store.provenance import to_json

WITH_ROW, LATER = "w", "l"
"""First letter of a hash: it was made with the row, or later, when the database was upgraded."""
HASHES = ("checksum", "chain_hash")
"""Columns that hold a hash over their row."""
_ROWS_AT_ONCE = 5_000


def checksum(mark: str, values: Mapping[str, Any]) -> str:
    """64 bits over a row's values against damage, after `mark` (`WITH_ROW` or `LATER`)."""
    return mark + hashlib.blake2b((mark + _text(values)).encode(errors="surrogateescape"), digest_size=8).hexdigest()


def chain_hash(mark: str, previous: str, values: Mapping[str, Any]) -> str:
    """SHA-256 over the hash of the previous row and the values of this one, after `mark`."""
    return mark + hashlib.sha256(f"{mark}{previous}\n{_text(values)}".encode(errors="surrogateescape")).hexdigest()


def hashed_values(table: Table, value_of: Callable[[str], Any]) -> dict[str, Any]:
    """The values of a row that is about to be stored, as its hash takes them; `value_of` gives that of a column."""
    values = ((name, stored, value_of(name)) for name, stored in _conversions(table))
    return {name: stored(value) for name, stored, value in values if value is not None}


def stored_rows(
    connection: Connection, table: Table, *conditions: ColumnElement[bool]
) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """The rows of a table that fit, by number: keys and hashes of each, and the values under its hash.

    Text of a damaged SQLite file that is none is read with replacements.
    """
    named = [column.name for column in table.columns if column.primary_key or column.name in HASHES]
    hashed = [column.name for column in _hashed(table)]
    for row in _rows(connection, table, conditions):
        yield {name: row[name] for name in named}, {name: row[name] for name in hashed}


def _plain_rows(connection: Connection, table: Table, conditions: Sequence[ColumnElement[bool]]) -> Iterator[Row[Any]]:
    """The rows as SQLite has them: conversions, and values that are read from an index, would hide some damage."""
    number: ColumnClause[Any] = literal_column("rowid")
    columns: list[ColumnClause[Any]] = [literal_column(column.name) for column in table.columns]
    query = select(*columns).select_from(table).order_by(number)
    if conditions:
        query = query.where(number.in_(select(number).select_from(table).where(*conditions).correlate(None)))
    driver: Any = connection.connection.driver_connection
    before, driver.text_factory = driver.text_factory, lambda read: read.decode(errors="surrogateescape")
    try:
        yield from connection.execute(query)
    finally:
        driver.text_factory = before


def _rows(connection: Connection, table: Table, conditions: Sequence[ColumnElement[bool]]) -> Iterator[dict[str, Any]]:
    names = [column.name for column in table.columns]
    if connection.dialect.name == "sqlite":
        yield from (dict(zip(names, row, strict=True)) for row in _plain_rows(connection, table, conditions))
        return
    columns = [cast(column, Text) if isinstance(column.type, JSON) else column for column in table.columns]
    keys = list(table.primary_key)
    page, last = select(*columns).where(*conditions).order_by(*keys).limit(_ROWS_AT_ONCE), tuple[Any, ...]()
    while True:
        rows = connection.execute(page.where(tuple_(*keys) > last) if last else page).all()
        yield from ({name: _plain(value) for name, value in zip(names, row, strict=True)} for row in rows)
        if len(rows) < _ROWS_AT_ONCE:
            return
        last = tuple(rows[-1][names.index(key.name)] for key in keys)


@cache
def _conversions(table: Table) -> tuple[tuple[str, Callable[[Any], Any]], ...]:
    """The columns under the hash of a row, with what makes a value that is about to be stored one as SQLite has it."""
    return tuple((column.name, _conversion(column)) for column in _hashed(table))


def _conversion(column: Column[Any]) -> Callable[[Any], Any]:
    match column.type.impl_instance if isinstance(column.type, TypeDecorator) else column.type:
        case JSON():
            return to_json
        case Boolean():
            return int
        case Integer():
            return index
        case Double():
            return lambda value: _plain(float(value))
        case _:
            return lambda value: _plain(getattr(value, "value", value))  # an Enum is stored as its value


def _hashed(table: Table) -> list[Column[Any]]:
    return [column for column in table.columns if column.name not in (*HASHES, "id")]


def _plain(value: Any) -> Any:
    match value:
        case bool():
            return int(value)
        case float():
            return None if math.isnan(value) else value + 0.0  # SQLite has neither NaN nor a negative zero
        case datetime():
            return value.astimezone(UTC).replace(tzinfo=None).isoformat(" ", "microseconds")
        case date():
            return value.isoformat()
        case _:
            return value


def _text(values: Mapping[str, Any]) -> str:
    known = {name: value for name, value in values.items() if value is not None}
    return json.dumps(known, sort_keys=True, separators=(",", ":"), default=lambda value: {"bytes": value.hex()})
