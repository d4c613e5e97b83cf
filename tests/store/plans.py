"""How a database finds the rows of what is asked for."""

from collections.abc import Callable
from typing import Any

from sqlalchemy import event
from sqlalchemy.orm import Session

from store.catalogue import Catalogue


def plans_of(catalogue: Catalogue, ask: Callable[[Session], object]) -> list[str]:
    """The lines of the plans of every statement that is sent; on PostgreSQL with what they took."""
    sent: list[tuple[str, Any]] = []
    with catalogue.reading(long=True) as session:
        connection = session.connection()

        def note(_c: Any, _cursor: Any, statement: str, parameters: Any, *_rest: Any) -> None:
            sent.append((statement, parameters))

        event.listen(connection, "before_cursor_execute", note)
        ask(session)
        event.remove(connection, "before_cursor_execute", note)
        explain = "EXPLAIN ANALYZE" if connection.dialect.name == "postgresql" else "EXPLAIN QUERY PLAN"
        once = {(statement, repr(parameters)): parameters for statement, parameters in sent}
        return [
            str(row[-1])
            for (statement, _), parameters in once.items()
            for row in connection.exec_driver_sql(f"{explain} {statement}", parameters)
        ]
