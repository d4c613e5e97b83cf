"""Progress of longer work: `with progress("files", 12) as advance:` ... `advance(1)`."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

Advance = Callable[[int], None]
Progress = Callable[[str, int], AbstractContextManager[Advance]]


@contextmanager
def silent(what: str, total: int) -> Iterator[Advance]:  # noqa: ARG001 - the signature of a Progress
    """Report nothing."""
    yield lambda done: None  # noqa: ARG005 - as above
