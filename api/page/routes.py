"""Routes of the page: each view under /page, on the same rig and catalogue as the service."""

from collections.abc import Awaitable, Callable, Mapping

import nicegui
from fastapi import FastAPI, Request
from fastapi.responses import RedirectResponse
from nicegui import ui

from api.page import views
from api.page.door import Door
from api.page.downloads import add_downloads
from api.page.frame import VIEWS, Frame
from api.page.login import HOME, add_log_in
from api.service.context import Services

Build = Callable[[Frame, Mapping[str, str]], Awaitable[None]]
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
    nicegui.core.sio.eio.cors_allowed_origins = []  # the door checks origins; NiceGUI would permit every one
    add_log_in(app, services)
    add_downloads(app, services)
    app.add_middleware(Door, services=services)

    @app.get("/", include_in_schema=False)
    def home() -> RedirectResponse:
        """To the dashboard."""
        return RedirectResponse(HOME)

    for title, address in VIEWS.items():
        _add_view(title, address)
    ui.run_with(
        app, mount_path="/page", title="Jointlab", favicon="data:,", language="en-US", tailwind=False,
        show_welcome_message=False, reconnect_timeout=6.0,
    )  # fmt: skip


def _add_view(title: str, address: str) -> None:
    @ui.page(address.removeprefix("/page"), title=f"{title} · Jointlab", response_timeout=LONGEST_BUILD)
    async def page(request: Request) -> None:
        await BUILDERS[title](Frame(request.state.login, request.state.caller, title), request.query_params)
