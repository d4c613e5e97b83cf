"""Something that happens right before a certain statement, such as a line that breaks."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from sqlalchemy import Connection, Engine, event

COMMIT = "COMMIT"


@contextmanager
def before(is_wanted: Callable[[list[str]], bool], do: Callable[[Connection], None]) -> Iterator[list[str]]:
    """Call `do` once, before the first statement where `is_wanted` holds of all so far; a commit counts as one."""
    seen: list[str] = []
    done: list[bool] = []

    def look(connection: Connection, statement: str) -> None:
        seen.append(statement)
        if not done and is_wanted(seen):
            done.append(True)
            do(connection)

    def execute(connection: Connection, _cursor: object, statement: str, *_rest: object) -> None:
        look(connection, statement)

    def commit(connection: Connection) -> None:
        look(connection, COMMIT)

    event.listen(Engine, "before_cursor_execute", execute)
    event.listen(Engine, "commit", commit)
    try:
        yield seen
    finally:
        event.remove(Engine, "before_cursor_execute", execute)
        event.remove(Engine, "commit", commit)
