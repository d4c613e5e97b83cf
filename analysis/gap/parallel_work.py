"""Work that may be done side by side: who calls the diagnosis decides by how many hands."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Protocol, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


class ParallelMap(Protocol):
    """Does the same work on each of several items, and gives the results in their order.

    What it is given can be pickled, so that hands may be processes of their own.
    """

    def __call__(self, work: Callable[[Item], Result], items: Sequence[Item], /) -> Iterable[Result]:
        """The results."""


def one_by_one(work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Without any help."""
    return [work(each) for each in items]
