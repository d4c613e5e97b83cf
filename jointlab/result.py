"""The result of a function of the public Python API, shown as tables in a notebook and as text by `print`."""

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

SHOWN_ROWS = 24
"""Rows of a table that are shown at most."""

Cell = str | int | float | bool | None
ResultRow = Mapping[str, Any]  # of cells
Details = TypeVar("Details")


@dataclass(frozen=True, eq=False)
class Result(Generic[Details]):
    """The result of a function of this API. A notebook shows it as tables, `print` as text.

    Attributes:
        title: of the measurement.
        tables: rows by the name of the table, SI units, the columns called as in the SQL views. A row is a mapping, so
            ``pandas.DataFrame(result.tables["modes"])`` is a data frame.
        notes: remarks on the numbers, one sentence each.
        details: everything that was computed, with arrays and covariances.
    """

    title: str
    tables: Mapping[str, Sequence[ResultRow]]
    details: Details
    notes: tuple[str, ...] = field(default=())

    def __repr__(self) -> str:
        parts = [self.title, *self.notes]
        for name, rows in self.tables.items():
            columns = [
                [head, *cells] for head, cells in zip(_heads(rows), zip(*_shown(rows), strict=True), strict=True)
            ]
            widths = [max(map(len, column)) for column in columns]
            lines = ["  ".join(map(str.rjust, line, widths)).rstrip() for line in zip(*columns, strict=True)]
            parts += ["", f"{name}:", *lines, *_rest(rows)]
        return "\n".join(parts)

    def _repr_html_(self) -> str:
        parts = [f"<p><b>{html.escape(self.title)}</b></p>", *(f"<p>{html.escape(note)}</p>" for note in self.notes)]
        for name, rows in self.tables.items():
            lines = [("th", _heads(rows)), *(("td", cells) for cells in _shown(rows))]
            body = "".join(
                f"<tr>{''.join(f'<{tag}>{html.escape(cell)}</{tag}>' for cell in cells)}</tr>" for tag, cells in lines
            )
            parts.append(f"<p>{html.escape(name)}</p><table>{body}</table>{''.join(_rest(rows))}")
        return "".join(parts)


def _heads(rows: Sequence[ResultRow]) -> list[str]:
    return list(rows[0]) if rows else []


def _shown(rows: Sequence[ResultRow]) -> list[list[str]]:
    return [[_text(cell) for cell in row.values()] for row in rows[:SHOWN_ROWS]]


def _rest(rows: Sequence[ResultRow]) -> list[str]:
    return [f"and {len(rows) - SHOWN_ROWS} more rows"] if len(rows) > SHOWN_ROWS else []


def _text(cell: Cell) -> str:
    if isinstance(cell, float):
        return f"{cell:.5g}"
    return "" if cell is None else str(cell)
