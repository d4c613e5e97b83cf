"""A part of a catalogue that is checked by itself: some of its runs, with every row that belongs to one of them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import ColumnElement, Table, func, select

from store.catalogue import Catalogue
from store.errors import StoreError
from store.models.base import Base
from store.models.measurements import RunRow
from store.models.results import AnalysisRow, AnalysisRunRow

Rows = tuple[Table, tuple[ColumnElement[bool], ...]]
"""A table, and the conditions that some of its rows fulfil; none for every row."""
_RUNS_AT_ONCE = 20


@dataclass(frozen=True)
class Part:
    """The runs that fit all of what is given; every run where nothing is.

    Attributes:
        runs: their numbers; none for any.
        since: they began at this time or later, UTC.
        share: (k, n) for the k-th of n shares, 1 <= k <= n. A run is always in the same one, whatever runs follow.

    Raises StoreError if there is no such share.
    """

    runs: tuple[int, ...] = ()
    since: datetime | None = None
    share: tuple[int, int] = (1, 1)

    def __post_init__(self) -> None:
        number, shares = self.share
        if not 1 <= number <= shares:
            raise StoreError(f"there is no part {number} of {shares}; parts count from 1 to their number")

    @property
    def is_first(self) -> bool:
        """Whether it is the first share of all runs, which has what belongs to no run, too."""
        return not self.runs and self.since is None and self.share[0] == 1

    def count(self, catalogue: Catalogue) -> int:
        """How many runs it has now."""
        with catalogue.reading() as session:
            return session.scalar(select(func.count()).select_from(RunRow).where(*self._conditions())) or 0

    def batches(self, catalogue: Catalogue) -> Iterator[list[int]]:
        """Numbers of its runs that are there now, a few at a time."""
        with catalogue.reading() as session:
            end = session.scalar(select(func.max(RunRow.id))) or 0
        query = select(RunRow.id).where(*self._conditions(), RunRow.id <= end).order_by(RunRow.id).limit(_RUNS_AT_ONCE)
        last = 0
        while True:
            with catalogue.reading() as session:
                numbers = list(session.scalars(query.where(RunRow.id > last)))
            if not numbers:
                return
            yield numbers
            last = numbers[-1]

    def _conditions(self) -> list[ColumnElement[bool]]:
        number, shares = self.share
        found = [RunRow.id % shares == number % shares]
        if self.runs:
            found.append(RunRow.id.in_(self.runs))
        if self.since is not None:
            found.append(RunRow.started_at >= self.since)
        return found


WHOLE = Part()


def rows_of(runs: Sequence[int]) -> list[Rows]:
    """The rows of each table that belong to one of `runs`, by themselves or through others.

    A result belongs to each run that its analysis used. A table whose rows belong to no run is left out.
    """
    found = ((table, _belonging_to(table, runs)) for table in Base.metadata.sorted_tables)
    return [(table, (condition,)) for table, condition in found if condition is not None]


def rows_of_no_run() -> list[Rows]:
    """Every row of each table whose rows belong to no run."""
    return [(table, ()) for table in Base.metadata.sorted_tables if _belonging_to(table, ()) is None]


def every_row() -> list[Rows]:
    """Every row of each table."""
    return [(table, ()) for table in Base.metadata.sorted_tables]


def _belonging_to(table: Table, runs: Sequence[int]) -> ColumnElement[bool] | None:
    if table is RunRow.__table__:
        return RunRow.id.in_(runs)
    if table is AnalysisRow.__table__:
        return AnalysisRow.id.in_(select(AnalysisRunRow.analysis_id).where(AnalysisRunRow.run_id.in_(runs)))
    for column in table.columns:
        for key in () if column.nullable else column.foreign_keys:
            condition = _belonging_to(key.column.table, runs)
            if condition is not None:
                return column.in_(select(key.column).where(condition))
    return None
