"""The application: every resource under /api, problems for errors, and documentation without an outside network."""

import logging
from collections.abc import AsyncIterator
from contextlib import ExitStack, asynccontextmanager
from typing import Any

from anyio import to_thread
from fastapi import APIRouter, FastAPI
from fastapi.routing import APIRoute
from fastapi_offline import FastAPIOffline

from api.service.bodies import BodyLimit
from api.service.context import Services
from api.service.headers import SecurityHeaders
from api.service.metrics import Metrics
from api.service.problems import Problem, handle_problems
from api.service.read_limit import ReadLimit
from api.service.request_log import RequestLog
from api.service.resources import (
    administration,
    alarms,
    examinations,
    health,
    investigations,
    jobs,
    laboratory,
    master_curves,
    metrics,
    overlays,
    records,
    results,
    rig,
    rigs,
    runs,
    sequences,
    tables,
)
from jointlab.disk_probe import DiskProbe
from jointlab.supervision.manager import RunManager
from rig.errors import RigError
from store.probe import DatabaseProbe
from store.version import release

RESOURCES: tuple[APIRouter, ...] = (
    health.router,
    metrics.router,
    laboratory.instruments,
    laboratory.channels,
    laboratory.specimens,
    sequences.router,
    rig.router,
    rigs.router,
    examinations.router,
    runs.router,
    records.router,
    results.analyses,
    results.frequency_responses,
    results.modes,
    results.joint_matrices,
    results.dynamic_stiffness,
    results.comparisons,
    overlays.router,
    results.diagnoses,
    master_curves.router,
    investigations.router,
    tables.router,
    jobs.identifications,
    jobs.trials,
    jobs.exports,
    jobs.jobs,
    alarms.router,
    administration.keys,
    administration.audit,
)

log = logging.getLogger(__name__)

THREADS = 4
"""The number of requests that are worked on at a time. They share one interpreter, so that more would not be faster."""
DESCRIPTION = """
Measures elastomeric joints and identifies their stiffness k, structural damping h and loss factor gamma.

SI units; a field whose unit is another says so, and every quantity has its unit as `x-unit`. Times are UTC. Errors are
problem documents (RFC 9457). Lists come in pages. Requests that act need an `Idempotency-Key`, and requests that
drive the rig the control lease; STOP needs neither.
"""


def create_app(services: Services) -> FastAPI:
    """The application on `services`; when it is shut down, the actuator is brought to rest."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        to_thread.current_default_thread_limiter().total_tokens = THREADS
        folders = (services.catalogue.waveforms.folder, *services.written_folders)
        with DatabaseProbe(services.catalogue) as app.state.probe, DiskProbe(folders) as app.state.disks:
            yield
        with ExitStack() as stack:  # each is closed, whatever happens to another
            for each in (services.bursts, services.jobs, services.hall, services.alarms):
                if each is not None:
                    stack.callback(each.close)
            if services.runs is not None:
                _close(services.runs)  # first: the others wait for programs elsewhere, such as a mail server

    app = FastAPIOffline(
        title="Jointlab", version=release(), description=DESCRIPTION.strip(), lifespan=lifespan,
        generate_unique_id_function=operation_id,
    )  # fmt: skip
    app.state.services, app.state.metrics = services, Metrics()
    for router in RESOURCES:
        app.include_router(router, prefix="/api")
    handle_problems(app)
    _describe_problems(app)
    app.add_middleware(ReadLimit)
    app.add_middleware(SecurityHeaders)
    app.add_middleware(BodyLimit)
    app.add_middleware(RequestLog)
    return app


def _close(runs: RunManager) -> None:
    """End the present run and the link to the rig; people read in the log where the actuator may still move."""
    try:
        runs.close()
    except RigError as error:
        log.error("%s", error)


def operation_id(route: APIRoute) -> str:
    """The name of an operation in the schema, such as runs-create."""
    return "-".join([*map(str, route.tags), route.name.strip("_")]).replace(" ", "-").replace("_", "-")


def _describe_problems(app: FastAPI) -> None:
    """Put the problem document, to which every route refers, into the schema."""
    made = app.openapi

    def openapi() -> dict[str, Any]:
        schema = made()
        schema["components"]["schemas"].setdefault("Problem", Problem.model_json_schema())
        return schema

    app.openapi = openapi  # type: ignore[method-assign]  # as FastAPI's documentation extends a schema
