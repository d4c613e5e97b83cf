"""Routes of the results of a run as tables, for programs that read CSV or Parquet."""

from fastapi import APIRouter, Response

from api.service.access import ReaderContext
from api.service.etags import TaggedRoute
from api.service.pages import Page, Paging
from api.service.parameters import RunNumber
from api.service.problems import problems
from api.service.tables import MEDIA, Form, TableName, table_file
from jointlab.documents.results import TableColumn, TableSummary
from store.exports.content import content_of
from store.exports.tables import ColumnsByName, tables_of

router = APIRouter(prefix="/runs/{run_id}/tables", tags=["tables"], route_class=TaggedRoute)
FILES = {"description": "the table", "content": {media: {} for media in MEDIA}}


@router.get("", name="list_", responses=problems(404, 500))
def list_tables(context: ReaderContext, paging: Paging, run_id: RunNumber) -> Page[TableSummary]:
    """List the tables of a run's newest results: their columns with units, and the number of rows."""
    with context.catalogue.reading() as session:
        found = tables_of(content_of(session, run_id).parts)
    return paging.of_whole([_summary(name, table) for name, table in found.items()])


@router.get("/{name}.{form}", name="get", response_class=Response, responses=problems(404, 500) | {200: FILES})
def one_table(context: ReaderContext, run_id: RunNumber, name: TableName, form: Form) -> Response:
    """One table as CSV, with units in its head, or as Parquet, with units and origin as metadata."""
    return table_file(context.catalogue, run_id, name, form)


def _summary(name: str, table: ColumnsByName) -> TableSummary:
    columns = tuple(TableColumn(name=each, unit=column.unit) for each, column in table.items())
    return TableSummary(name=name, rows=next(iter(table.values())).values.size, columns=columns)
