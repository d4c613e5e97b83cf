"""Progress of longer work: `with progress("files", 12) as advance:` ... `advance(1)`."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol


class Advance(Protocol):
    """Tells that work goes on."""

    def __call__(self, done: int, now: str = "") -> None:
        """Tell of `done` further steps, and in words what is done now; each call replaces the words of the last one."""


Progress = Callable[[str, int], AbstractContextManager[Advance]]


@contextmanager
def silent(what: str, total: int) -> Iterator[Advance]:  # noqa: ARG001 - the signature of a Progress
    """Report nothing."""

    def advance(done: int, now: str = "") -> None:
        del done, now

    yield advance
