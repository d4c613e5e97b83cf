"""A table of results as a file, for programs and for the page."""

from collections.abc import Callable, Mapping
from typing import Annotated, Literal

from fastapi import Path, Response

from store.catalogue import Catalogue
from store.exports.content import RunContent, content_of
from store.exports.parquet import origin
from store.exports.tables import ColumnsByName, as_csv, as_parquet, kind_of, named_table
from store.validation import TextLike

Form = Literal["csv", "parquet"]
TableName = Annotated[
    str,
    TextLike("^[a-z][a-z_]{0,99}$", "write 1 to 100 small letters and underscores, such as runs"),
    Path(description="its name in the list of tables"),
]
_WRITERS: Mapping[Form, tuple[str, Callable[[ColumnsByName, RunContent], bytes]]] = {
    "csv": ("text/csv", lambda table, _content: as_csv(table)),
    "parquet": ("application/vnd.apache.parquet", lambda table, content: as_parquet(table, origin(content))),
}
MEDIA = tuple(media for media, _ in _WRITERS.values())
"""The types of the files."""


def table_file(catalogue: Catalogue, run_id: int, name: str, form: Form) -> Response:
    """One table of the newest results of a run.

    Raises:
        NotFoundError: there is no such run or table.
        DamagedError: a result is damaged.
        MissingExtraError: Parquet needs an extra.
    """
    content = catalogue.read(content_of, run_id, (kind_of(name),))
    media, write = _WRITERS[form]
    saved = {"Content-Disposition": f'attachment; filename="run-{run_id}-{name}.{form}"'}
    return Response(write(named_table(content, name), content), media_type=media, headers=saved)
