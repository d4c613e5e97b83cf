"""Routes of the page: each view under /page, on the same rig and catalogue as the service."""

from collections.abc import Awaitable, Callable, Mapping
from html import escape
from typing import Annotated

import nicegui
from fastapi import FastAPI, Request
from fastapi.middleware.gzip import GZipMiddleware
from fastapi.responses import RedirectResponse, Response
from nicegui import ui
from starlette.datastructures import QueryParams
from starlette.types import ASGIApp

from api.page import views
from api.page.access import PageAccess
from api.page.frame import VIEWS, Frame
from api.page.login import HOME, add_log_in
from api.page.markup import show
from api.service.context import Services
from api.service.downloads import Download
from api.service.parameters import RunNumber, number_of
from api.service.tables import TableName, table_file
from jointlab.jobs.kinds import export_file

Build = Callable[[Frame, QueryParams], Awaitable[None]]
MEDIA = {
    ".html": "text/html",
    ".zip": "application/zip",
    ".h5": "application/x-hdf5",
    ".jsonl": "application/jsonl",
    ".mat": "application/x-matlab-data",
    ".pdf": "application/pdf",
    ".unv": "application/octet-stream",
}
PING_INTERVAL, PING_TIMEOUT = 1.2, 6.0
"""Seconds from a page's answer to the next ping, and seconds without an answer after which the page is given up.

A busy page does not answer. A page whose connection is silent notices this after the sum of both times.
"""
LONGEST_BUILD = 30.0
"""Seconds that a view may take until it is sent; each of its reads has a deadline of its own."""

BUILDERS: Mapping[str, Build] = {
    "Dashboard": views.dashboard.build,
    "Measure": views.measure.build,
    "Hammer": views.hammer.build,
    "Sweep": views.sweep.build,
    "Runs": views.runs.build,
    "Results": views.results.build,
    "Gap": views.gap.build,
    "Instruments": views.instruments.build,
    "Laboratory": views.laboratory.build,
    "Alarms": views.alarms.build,
    "Hall": views.hall.build,
}
"""The function that builds each of `VIEWS`."""


def mount(app: FastAPI, services: Services) -> None:
    """Add the page to the application, once in a process: NiceGUI keeps its pages for the whole process."""
    nicegui.run.process_pool_start_method = "spawn"  # a fork would inherit the threads that drive the rig
    nicegui.app.config.quasar_config["loadingBar"] = {"skipHijack": True}  # a bar for every request, without a name
    nicegui.core.sio.eio.cors_allowed_origins = []  # `PageAccess` checks origins; NiceGUI would permit every one
    nicegui.app.on_startup(_set_pings)  # NiceGUI, when it starts, sets others: 0.8 and 0.4 of reconnect_timeout
    add_log_in(app, services)
    add_downloads(app, services)
    app.add_middleware(PageAccess, services=services)

    @app.get("/", include_in_schema=False)
    def home() -> RedirectResponse:
        """To the dashboard."""
        return RedirectResponse(HOME)

    for title, address in VIEWS.items():
        _add_view(title, address)
    ui.run_with(
        app, root=_no_such_view, mount_path="/page", title="Jointlab", favicon="data:,", language="en-US",
        tailwind=False, show_welcome_message=False, reconnect_timeout=6.0, gzip_middleware_factory=_compressed,
    )  # fmt: skip


def _compressed(app: ASGIApp) -> GZipMiddleware:
    """The pages compressed in half the time of the highest level, for a seventh more bytes."""
    return GZipMiddleware(app, compresslevel=1)


async def _no_such_view(request: Request) -> None:
    """What is shown at an address of no view, with STOP and the ways to all views."""
    frame = Frame(request.state.login, request.state.caller, "No such page")
    text = f"<p>There is none at {escape(request.url.path)}. Choose one above.</p>"

    async def build() -> None:
        show(text)

    await frame.build(build)


def _set_pings() -> None:
    engine = nicegui.core.sio.eio
    engine.ping_interval, engine.ping_timeout = PING_INTERVAL, PING_TIMEOUT


def _add_view(title: str, address: str) -> None:
    @ui.page(address.removeprefix("/page"), title=f"{title} · Jointlab", response_timeout=LONGEST_BUILD)
    async def page(request: Request) -> None:
        frame = Frame(request.state.login, request.state.caller, title)
        await frame.build(lambda: BUILDERS[title](frame, request.query_params))


def add_downloads(app: FastAPI, services: Services) -> None:
    """Routes of files, behind the access check of the page."""

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
