"""Routes of the page: each view under /page, on the same rig and catalogue as the service."""

from collections.abc import Callable, Mapping

import nicegui
from fastapi import FastAPI, Request
from fastapi.responses import RedirectResponse, Response
from nicegui import ui

from api.page import views
from api.page.downloads import add_downloads
from api.page.frame import VIEWS, Frame
from api.page.login import HOME, add_log_in, log_in_address, login_of
from api.service.context import Services
from api.service.problems import AccessError
from store.states import Scope

Build = Callable[[Frame, Mapping[str, str]], None]


BUILDERS: Mapping[str, Build] = {
    "Dashboard": views.dashboard.build,
    "Measure": views.measure.build,
    "Hammer": views.hammer.build,
    "Sweep": views.sweep.build,
    "Runs": views.runs.build,
    "Results": views.results.build,
    "Gap": views.gap.build,
    "Laboratory": views.laboratory.build,
}
"""The function that builds each of `VIEWS`."""


def mount(app: FastAPI, services: Services) -> None:
    """Add the page to the application, once in a process: NiceGUI keeps its pages for the whole process."""
    nicegui.run.process_pool_start_method = "spawn"  # a fork would inherit the threads that drive the rig
    nicegui.app.config.quasar_config["loadingBar"] = {"skipHijack": True}  # a bar for every request, without a name
    add_log_in(app, services)
    add_downloads(app, services)

    @app.get("/", include_in_schema=False)
    def home() -> Response:
        """To the dashboard."""
        return RedirectResponse(HOME)

    for title, address in VIEWS.items():
        _add_view(title, address, services)
    ui.run_with(
        app, mount_path="/page", title="Jointlab", favicon="data:,", language="en-US", tailwind=False,
        show_welcome_message=False, reconnect_timeout=6.0,
    )  # fmt: skip


def _add_view(title: str, address: str, services: Services) -> None:
    @ui.page(address.removeprefix("/page"), title=f"{title} · Jointlab")
    def page(request: Request) -> Response | None:
        login = login_of(services, request)
        try:
            caller = login.caller()
            if Scope.READ not in caller.scopes:
                raise AccessError(403, f"{caller.name} may not read; log in with a key that has {Scope.READ}")
        except AccessError as error:
            why = str(error) if login.secret else ""  # without any key there is nothing to explain
            return RedirectResponse(log_in_address(request, why))
        BUILDERS[title](Frame(login, caller, title), request.query_params)
        return None
