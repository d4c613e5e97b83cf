"""Errors by RFC 9457: one problem document for every error, and its declaration in the schema."""

import logging
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from pydantic import BaseModel, Field
from starlette.exceptions import HTTPException
from starlette.routing import Match, Mount

from analysis.errors import AnalysisError
from daq.errors import ChannelError, DaqError
from jointlab.errors import ConflictError, JointlabError
from jointlab.jobs.limits import QuotaError
from jointlab.supervision.lease import ForeignLeaseError
from rig.control import PauseOverError
from rig.errors import UNEXPECTED, RequestError, RigError, RunStoppedError, with_notes
from rig.runs.completed_points import ResumeError
from rig.tester.stop_latch import LeaseLostError, StopNotResetError
from store.errors import DamagedError, NotFoundError, StoreError, WrongRigError
from store.extras import MissingExtraError
from store.measurements.locks import RunBusyError
from store.validation import faults_text

PROBLEM_JSON = "application/problem+json"
log = logging.getLogger(__name__)


class Problem(BaseModel):
    """An error by RFC 9457; `detail` says what was wrong, where, and what to do."""

    type: str = "about:blank"
    title: str
    status: int = Field(ge=400, le=599)
    detail: str


class AccessError(Exception):
    """The caller is not known (401), or may not do this (403)."""

    def __init__(self, status: int, detail: str) -> None:
        super().__init__(detail)
        self.status = status


class PreconditionError(Exception):
    """The document that the caller has read has changed."""


TITLES = {
    401: "The caller is not known",
    403: "This key does not allow it",
    404: "Not found",
    409: "Not in the present state",
    412: "It has changed since",
    422: "The request is not valid",
    429: "Too many at a time",
    500: "An unexpected error",
    502: "An instrument does not answer or obey",
    503: "The store does not answer",
}

# The HTTP status of each error; the first class that fits counts.
STATUS_OF: tuple[tuple[type[Exception], int], ...] = (
    (PreconditionError, 412),
    (QuotaError, 429),
    (ForeignLeaseError, 403),
    (ConflictError, 409),
    (PauseOverError, 409),
    (ResumeError, 409),
    (RunStoppedError, 409),
    (LeaseLostError, 409),
    (StopNotResetError, 409),
    (RunBusyError, 409),
    (WrongRigError, 409),
    (NotFoundError, 404),
    (DamagedError, 500),
    (MissingExtraError, 422),
    (StoreError, 503),
    (ChannelError, 422),
    (RequestError, 422),
    (AnalysisError, 422),
    (JointlabError, 422),
    (DaqError, 502),
    (RigError, 502),
)


def problems(*statuses: int, needs_key: bool = True) -> dict[int | str, dict[str, Any]]:
    """For the `responses` of a route: these problems, those of every route, and where it needs a key, 401 and 403."""
    content = {PROBLEM_JSON: {"schema": {"$ref": "#/components/schemas/Problem"}}}
    always = {422, 503, *((401, 403) if needs_key else ())}
    return {status: {"description": TITLES[status], "content": content} for status in sorted({*always, *statuses})}


def status_of(error: Exception) -> int:
    """HTTP status of an error; 500 for an unexpected one."""
    return next((status for kind, status in STATUS_OF if isinstance(error, kind)), 500)


def handle_problems(service: FastAPI) -> None:
    """Turn every error of `service` into a problem document."""
    for kind, _ in STATUS_OF:
        service.add_exception_handler(kind, _expected)
    service.add_exception_handler(AccessError, _refused)
    service.add_exception_handler(HTTPException, _by_framework)
    service.add_exception_handler(RequestValidationError, _unfit)
    service.add_exception_handler(Exception, _unexpected)


def problem(status: int, detail: str, headers: dict[str, str] | None = None) -> JSONResponse:
    """A problem document as an answer."""
    found = Problem(title=TITLES.get(status, HTTPStatus(status).phrase), status=status, detail=detail)
    return JSONResponse(found.model_dump(), status, headers, PROBLEM_JSON)


def _expected(_request: Request, error: Exception) -> JSONResponse:
    return problem(status_of(error), with_notes(str(error), error))


def _refused(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, AccessError)
    return problem(error.status, str(error), {"WWW-Authenticate": "Bearer"} if error.status == 401 else None)


def _by_framework(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    headers = dict(error.headers or {})
    if error.status_code == 405:
        headers["Allow"] = ", ".join(sorted(_methods(request)))
    # for the framework a body that is no text differs from one that is no JSON; for a caller it does not
    status = 422 if error.status_code == 400 else error.status_code
    return problem(status, f"{request.method} {request.url.path}: {error.detail}", headers)


def _methods(request: Request) -> set[str]:
    """The methods of this path; the framework knows only those of the first route that matches it."""
    return {
        method
        for method in ("DELETE", "GET", "PATCH", "POST", "PUT")
        for route in request.app.routes
        if route.matches({**request.scope, "method": method})[0] is Match.FULL and not isinstance(route, Mount)
    }


def _unfit(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    return problem(422, faults_text(error.errors(), "request"))


def _unexpected(request: Request, error: Exception) -> JSONResponse:
    log.error("%s %s", request.method, request.url.path, exc_info=error)
    return problem(500, UNEXPECTED)
