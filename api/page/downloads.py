"""Downloads: tables of a run as CSV, and the files of exports."""

from typing import Annotated

from fastapi import FastAPI, Request
from fastapi.responses import Response

from api.service.context import Services
from api.service.downloads import Download
from api.service.parameters import RunNumber, number_of
from api.service.tables import TableName, table_file
from jointlab.jobs.kinds import export_file

MEDIA = {
    ".html": "text/html",
    ".zip": "application/zip",
    ".h5": "application/x-hdf5",
    ".mat": "application/x-matlab-data",
    ".unv": "application/octet-stream",
}


def add_downloads(app: FastAPI, services: Services) -> None:
    """Routes of files, behind the door of the page."""

    @app.get("/page/files/{job_id}", include_in_schema=False)
    def file(request: Request, job_id: Annotated[int, number_of("job")]) -> Response:
        """The file of an export; a report opens in the browser."""
        path = export_file(services.catalogue, job_id)
        who, is_report = request.state.caller.name, path.suffix == ".html"
        return Download(path, services.downloads, who, media_type=MEDIA[path.suffix], inline=is_report)

    @app.get("/page/tables/{run_id}/{name}.csv", include_in_schema=False)
    def csv_table(run_id: RunNumber, name: TableName) -> Response:
        """One table of a run."""
        return table_file(services.catalogue, run_id, name, "csv")
