"""The page as a part of the service: each view under /page, in front of the same rig and catalogue."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import nicegui
from fastapi import FastAPI, Request
from fastapi.responses import RedirectResponse, Response
from nicegui import ui

from api.page import views
from api.page.downloads import add_downloads
from api.page.frame import VIEWS, Frame
from api.page.login import HOME, add_log_in, log_in_address, visitor_of
from api.service.context import Services
from api.service.problems import AccessError
from store.states import Scope

Build = Callable[[Frame, Mapping[str, str]], None]


@dataclass(frozen=True)
class _View:
    title: str
    build: Build


_VIEWS = (
    _View("Dashboard", views.dashboard.build),
    _View("Measure", views.measure.build),
    _View("Hammer", views.hammer.build),
    _View("Sweep", views.sweep.build),
    _View("Runs", views.runs.build),
    _View("Results", views.results.build),
    _View("Gap", views.gap.build),
    _View("Laboratory", views.laboratory.build),
)


def mount(app: FastAPI, services: Services) -> None:
    """Put the page in front of `services`. Once a process: NiceGUI keeps its pages for the whole of it."""
    nicegui.run.process_pool_start_method = "spawn"  # a fork would inherit the threads that drive the rig
    nicegui.app.config.quasar_config["loadingBar"] = {"skipHijack": True}  # a bar for every request, without a name
    add_log_in(app, services)
    add_downloads(app, services)

    @app.get("/", include_in_schema=False)
    def home() -> Response:
        """The page is what a person looks for."""
        return RedirectResponse(HOME)

    for view in _VIEWS:
        _add(view, services)
    ui.run_with(
        app, mount_path="/page", title="Jointlab", favicon="data:,", language="en-US", tailwind=False,
        show_welcome_message=False, reconnect_timeout=6.0,
    )  # fmt: skip


def _add(view: _View, services: Services) -> None:
    @ui.page(VIEWS[view.title].removeprefix("/page"), title=f"{view.title} · Jointlab")
    def page(request: Request) -> Response | None:
        visitor = visitor_of(services, request)
        try:
            caller = visitor.caller()
            if Scope.READ not in caller.scopes:
                raise AccessError(403, f"{caller.name} may not read; log in with a key that has {Scope.READ}")
        except AccessError as error:
            why = str(error) if visitor.secret else ""  # whoever has no key yet did nothing wrong
            return RedirectResponse(log_in_address(request, why))
        view.build(Frame(visitor, caller, view.title), request.query_params)
        return None
