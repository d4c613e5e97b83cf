"""Results as tables of rows and columns: one table for each kind of result and each set of dimensions."""

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from store.errors import NotFoundError
from store.exports.content import LIMIT, RunContent, RunPart, Variable
from store.extras import explained_imports

FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""Characters that begin a formula in a spreadsheet."""


@dataclass(frozen=True, eq=False)
class Column:
    """One value a row, NaN or an empty text where a part has none, with its unit."""

    values: NDArray[Any]
    unit: str


ColumnsByName = Mapping[str, Column]


def tables_of(parts: Sequence[RunPart]) -> dict[str, ColumnsByName]:
    """Tables by name: ``modes``, and ``modes_by_mode_dof`` for what has further dimensions.

    Each row begins with the labels of its part, such as analysis and joint, and with its places along the dimensions.
    Limits are two columns, ``_low`` and ``_high``; complex values ``_real`` and ``_imaginary``.
    """
    found: dict[str, list[ColumnsByName]] = {}
    first: dict[str, tuple[str, ...]] = {}
    for part in parts:
        for dims, table in _tables_of_part(part):
            is_first = first.setdefault(part.kind, dims) == dims
            name = part.kind if is_first else f"{part.kind}_by_{'_'.join(dims)}"
            found.setdefault(name, []).append(table)
    return {name: _joined(tables) for name, tables in found.items()}


def kind_of(table: str) -> str:
    """The kind of result that a table of this name has."""
    return table.partition("_by_")[0]


def named_table(content: RunContent, name: str) -> ColumnsByName:
    """One table; NotFoundError where the run has none of this name."""
    found = tables_of(content.parts)
    if name not in found:
        raise NotFoundError(f"run {content.attributes['run']} has no table {name!r}; its tables list those that it has")
    return found[name]


def as_csv(table: ColumnsByName) -> bytes:
    """The table as CSV; NaN is an empty field.

    A text that a spreadsheet would take for a formula begins with an apostrophe. Units are in the head, such as
    ``frequency (Hz)``; a unit of several words is only in the list of columns.
    """
    buffer = io.StringIO()
    writer = csv.writer(buffer)
    plain = {name: column.unit not in ("", "1") and " " not in column.unit for name, column in table.items()}
    writer.writerow([f"{name} ({column.unit})" if plain[name] else name for name, column in table.items()])
    columns = [[_cell(each) for each in column.values.tolist()] for column in table.values()]
    writer.writerows(zip(*columns, strict=True))
    return buffer.getvalue().encode()


def _cell(value: Any) -> Any:
    if isinstance(value, str):
        return f"'{value}" if value.startswith(FORMULA) else value
    return "" if value != value else value  # NaN


def as_parquet(table: ColumnsByName, metadata: Mapping[str, str]) -> bytes:
    """The table as Parquet; each column has its unit as metadata. Raises MissingExtraError without pyarrow."""
    with explained_imports():
        import pyarrow
        import pyarrow.parquet
    arrays = {name: pyarrow.array(column.values) for name, column in table.items()}
    fields = [pyarrow.field(name, arrays[name].type, metadata={"unit": column.unit}) for name, column in table.items()]
    made = pyarrow.table(list(arrays.values()), schema=pyarrow.schema(fields, metadata=dict(metadata)))
    buffer = io.BytesIO()
    pyarrow.parquet.write_table(made, buffer, compression="zstd")
    return buffer.getvalue()


def _tables_of_part(part: RunPart) -> Iterator[tuple[tuple[str, ...], ColumnsByName]]:
    places = {name: each for name, each in part.variables.items() if each.dims == (name,)}
    others = {name: each for name, each in part.variables.items() if name not in places}
    for dims in dict.fromkeys(_without_limits(each) for each in others.values()):
        here = {name: each for name, each in others.items() if _without_limits(each) == dims}
        one = next(iter(here.values()))
        shape = one.values.shape[: len(dims)]
        table = {name: Column(np.full(shape, value).ravel(), "") for name, value in part.labels.items()}
        for axis, dim in enumerate(dims):
            if dim in places:
                along = [size if index == axis else 1 for index, size in enumerate(shape)]
                spread = np.broadcast_to(places[dim].values.reshape(along), shape)
                table[dim] = Column(spread.ravel(), places[dim].unit)
        for name, variable in here.items():
            table.update(_columns(name, variable))
        yield dims, table


def _without_limits(variable: Variable) -> tuple[str, ...]:
    return tuple(dim for dim in variable.dims if dim != LIMIT)


def _columns(name: str, variable: Variable) -> ColumnsByName:
    values = variable.values
    if variable.dims[-1] == LIMIT:
        sides = {f"{name}_{side}": values[..., index] for index, side in enumerate(("low", "high"))}
    elif np.iscomplexobj(values):
        sides = {f"{name}_real": values.real, f"{name}_imaginary": values.imag}
    else:
        sides = {name: values}
    return {side: Column(each.ravel(), variable.unit) for side, each in sides.items()}


def _joined(tables: Sequence[ColumnsByName]) -> ColumnsByName:
    columns = {name: column for table in tables for name, column in table.items()}
    return {
        name: Column(np.concatenate([_values(table, name, like) for table in tables]), like.unit)
        for name, like in columns.items()
    }


def _values(table: ColumnsByName, name: str, like: Column) -> NDArray[Any]:
    if name in table:
        return table[name].values
    rows = next(iter(table.values())).values.size
    return np.full(rows, np.nan if like.values.dtype.kind in "fc" else "")
