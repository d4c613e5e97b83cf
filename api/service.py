"""The REST service: health, runs and their results. It reads; nothing here moves the machine."""

from __future__ import annotations

from datetime import datetime
from http import HTTPStatus
from typing import Annotated, Any

from fastapi import FastAPI, Path, Query, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from pydantic import BaseModel
from starlette.exceptions import HTTPException

from api.identification.document import plain
from store.analyses import AnalysisKind, latest_analysis
from store.catalogue import Catalogue
from store.dynamic_stiffness import list_dynamic_stiffness
from store.errors import NotFoundError, StoreError
from store.joint_matrices import list_joint_matrices
from store.modes import get_modes
from store.provenance import software_version
from store.runs import Run, RunState, get_run, list_runs

PROBLEM_JSON = "application/problem+json"
TITLES = {404: "Not found", 422: "The request does not fit", 503: "The store does not answer"}

RunNumber = Annotated[int, Path(ge=1, le=2**31 - 1, description="number of the run")]


class Health(BaseModel):
    """Whether the service can do its work."""

    status: str
    version: str
    database: str


class RunSummary(BaseModel):
    """One run; times are UTC."""

    id: int
    kind: str
    state: RunState
    title: str
    article: str
    started_at: datetime
    finished_at: datetime | None
    reason: str | None
    software_version: str

    @classmethod
    def of(cls, run: Run) -> RunSummary:
        """What is shown of a run."""
        return cls(**{name: getattr(run, name) for name in cls.model_fields})


class Problem(BaseModel):
    """An error as RFC 9457 has it."""

    type: str = "about:blank"
    title: str
    status: int
    detail: str


class ModesResult(BaseModel):
    """Modes: frequencies in Hz, loss factors, and their 95 % intervals."""

    frequency_hz: list[float]
    frequency_ci95: list[list[float | None]]
    loss_factor: list[float]
    loss_factor_ci95: list[list[float | None]]
    predicted_hz: list[float | None]


class JointResult(BaseModel):
    """A joint's k and h in N/m, N and N m; rows and columns are x, y, rotation; null is not known."""

    k: list[list[float]]
    h: list[list[float]]
    gamma: list[list[float | None]]
    k_ci95: list[list[list[float | None]]]
    h_ci95: list[list[list[float | None]]]
    observable: list[list[bool]]


class StiffnessPoint(BaseModel):
    """A sine point: amplitude asked for in mm p-p, frequency in Hz, k and h in N/m."""

    specimen: str
    configuration: str
    amplitude_pp_mm: float
    frequency: float
    stiffness: float
    stiffness_se: float | None
    damping: float
    damping_se: float | None
    loss_factor: float
    loss_factor_se: float | None
    flags: list[str]


def create_service(catalogue: Catalogue) -> FastAPI:
    """The service in front of an open catalogue."""
    service = FastAPI(
        title="Jointlab",
        version=software_version(),
        docs_url=None,  # its page loads from a CDN, and a laboratory has no outside network
        redoc_url=None,
        responses={
            status: {"description": title, "content": {PROBLEM_JSON: {"schema": Problem.model_json_schema()}}}
            for status, title in TITLES.items()
        },
    )

    service.add_exception_handler(NotFoundError, _not_found)
    service.add_exception_handler(StoreError, _store_failed)
    service.add_exception_handler(HTTPException, _no_such_route)
    service.add_exception_handler(RequestValidationError, _unfit)

    @service.get("/api/health")
    def health() -> Health:
        """Say whether the database answers."""
        with catalogue.reading() as session:
            list_runs(session, limit=1)
        return Health(status="ok", version=software_version(), database=catalogue.address)

    @service.get("/api/runs")
    def runs(
        state: RunState | None = None,
        limit: Annotated[int, Query(ge=1, le=1000)] = 100,
        offset: Annotated[int, Query(ge=0, le=2**31 - 1)] = 0,
    ) -> list[RunSummary]:
        """List runs, newest first."""
        with catalogue.reading() as session:
            return [RunSummary.of(run) for run in list_runs(session, state=state, limit=limit, offset=offset)]

    @service.get("/api/runs/{run_id}")
    def run(run_id: RunNumber) -> RunSummary:
        """One run."""
        with catalogue.reading() as session:
            return RunSummary.of(get_run(session, run_id))

    @service.get("/api/runs/{run_id}/modes")
    def modes(run_id: RunNumber) -> ModesResult:
        """The newest modes of a run."""
        with catalogue.reading() as session:
            found = get_modes(session, latest_analysis(session, run_id, AnalysisKind.MODES).id)
        return ModesResult(
            frequency_hz=plain(found.frequency),
            frequency_ci95=plain(found.frequency_ci95),
            loss_factor=plain(found.loss_factor),
            loss_factor_ci95=plain(found.loss_factor_ci95),
            predicted_hz=plain(found.predicted_frequency),
        )

    @service.get("/api/runs/{run_id}/joints")
    def joints(run_id: RunNumber) -> dict[str, JointResult]:
        """The newest joint matrices of a run, by joint."""
        with catalogue.reading() as session:
            found = list_joint_matrices(session, latest_analysis(session, run_id, AnalysisKind.JOINT_MATRICES).id)
        return {
            joint.joint: JointResult(
                k=plain(joint.stiffness),
                h=plain(joint.damping),
                gamma=plain(joint.loss_factor),
                k_ci95=plain(joint.stiffness_ci95),
                h_ci95=plain(joint.damping_ci95),
                observable=plain(joint.observable),
            )
            for joint in found
        }

    @service.get("/api/runs/{run_id}/dynamic-stiffness")
    def dynamic_stiffness(
        run_id: RunNumber, specimen: str | None = None, configuration: str | None = None
    ) -> list[StiffnessPoint]:
        """The newest sine points of a run in the order of measuring."""
        with catalogue.reading() as session:
            analysis = latest_analysis(session, run_id, AnalysisKind.DYNAMIC_STIFFNESS)
            found = list_dynamic_stiffness(session, analysis.id)
        return [
            StiffnessPoint(**{name: _listed(getattr(point, name)) for name in StiffnessPoint.model_fields})
            for point in found
            if specimen in (None, point.specimen) and configuration in (None, point.configuration)
        ]

    return service


def _listed(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _not_found(_request: Request, error: Exception) -> JSONResponse:
    return _problem(404, str(error))


def _store_failed(_request: Request, error: Exception) -> JSONResponse:
    return _problem(503, str(error))


def _no_such_route(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    problem = _problem(error.status_code, f"{request.method} {request.url.path}: {error.detail}")
    problem.headers.update(error.headers or {})
    return problem


def _unfit(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    return _problem(422, "; ".join(f"{'.'.join(map(str, item['loc']))}: {item['msg']}" for item in error.errors()))


def _problem(status: int, detail: str) -> JSONResponse:
    problem = Problem(title=TITLES.get(status, HTTPStatus(status).phrase), status=status, detail=detail)
    return JSONResponse(problem.model_dump(), status_code=status, media_type=PROBLEM_JSON)
