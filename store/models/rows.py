"""Rows of tables: get one by its number, list a page of them, and convert them to data classes and back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar

from sqlalchemy import ColumnElement, Select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import InstrumentedAttribute, Session
from sqlalchemy.orm.interfaces import ORMOption

from store.errors import NotFoundError
from store.models.base import Base

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_Row = TypeVar("_Row", bound=Base)
_Value = TypeVar("_Value", bound="DataclassInstance")
_Query = TypeVar("_Query", bound=Select[*tuple[Any, ...]])


def get_row(
    session: Session,
    table: type[_Row],
    number: int,
    name: str,
    options: Sequence[ORMOption] = (),
    *,
    for_update: bool = False,
) -> _Row:
    """The row with this number, or NotFoundError, which calls it `name`; `options` say how SQLAlchemy loads it.

    `for_update`: no other transaction changes it from now on, until this one ends.
    """
    row = session.get(table, number, options=options, with_for_update=for_update or None, populate_existing=for_update)
    if row is None:
        raise NotFoundError(f"there is no {name} {number}")
    return row


def add_row(session: Session, row: _Row) -> _Row:
    """Store a row; it has its number then."""
    session.add(row)
    session.flush()
    return row


def found_or_added(session: Session, query: Select[_Row], make: Callable[[], _Row]) -> tuple[_Row, bool]:
    """The row that `query` finds, or else the one that `make` makes, which is stored then; and whether it is new.

    On a server another transaction may have looked, too, and store the same row first: then that one is found, as soon
    as that transaction has ended.
    """
    found = session.scalars(query).first()
    if found is not None:
        return found, False
    session.flush()
    try:
        with session.begin_nested():
            return add_row(session, make()), True
    except IntegrityError:
        found = session.scalars(query).first()
        if found is None:  # something else was wrong with it
            raise
        return found, False


def from_row(kind: type[_Value], row: object, /, **other: Any) -> _Value:
    """A data class with the columns of the same names; `other` has the fields that are of another type or no column."""
    columns = {each.name: getattr(row, each.name) for each in fields(kind) if each.name not in other}
    return kind(**columns, **other)


def to_columns(value: DataclassInstance, table: type[Base]) -> dict[str, Any]:
    """The fields of a data class that are columns of `table`, by name, without the row's number."""
    names = (each.name for each in fields(value) if each.name in table.__table__.columns)
    return {name: getattr(value, name) for name in names if name != "id"}


def equal(table: type[Base], /, **wanted: Any) -> list[ColumnElement[bool]]:
    """Conditions that columns have these values; None stands for any value."""
    return [getattr(table, name) == value for name, value in wanted.items() if value is not None]


def newest_first(query: _Query, number: InstrumentedAttribute[int], before: int | None, limit: int) -> _Query:
    """One page of a list whose rows are numbered by `number`: those before the number where the last page ended."""
    if before is not None:
        query = query.where(number < before)
    return query.order_by(number.desc()).limit(limit)
