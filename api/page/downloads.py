"""Downloads: tables of a run as CSV, and the files of exports."""

import csv
import io
from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any

from fastapi import FastAPI, Request
from fastapi.responses import Response
from sqlalchemy.orm import Session

from api.service.context import Services
from api.service.downloads import Download
from api.service.parameters import RunNumber, number_of
from jointlab.documents.results import StiffnessPoint
from jointlab.identification.save import unobservable_reasons
from jointlab.jobs.kinds import export_file
from store.analyses import latest_analysis
from store.comparisons import list_comparisons
from store.dynamic_stiffness import list_dynamic_stiffness
from store.errors import NotFoundError
from store.frequency_responses import list_frequency_responses
from store.joint_matrices import list_joint_matrices
from store.modes import get_modes
from store.states import AnalysisKind

Rows = Iterable[tuple[Any, ...]]
MEDIA = {".html": "text/html", ".zip": "application/zip", ".h5": "application/x-hdf5"}

POINT_COLUMNS = tuple(name for name in StiffnessPoint.model_fields if name not in ("analysis_id", "flags"))
"""The service's fields of a sine point, without the number of the analysis and without sentences."""


def add_downloads(app: FastAPI, services: Services) -> None:
    """Routes of files, behind the door of the page."""

    @app.get("/page/files/{job_id}", include_in_schema=False)
    def file(request: Request, job_id: Annotated[int, number_of("job")]) -> Response:
        """The file of an export; a report opens in the browser."""
        path = export_file(services.catalogue, job_id)
        who, is_report = request.state.caller.name, path.suffix == ".html"
        return Download(path, services.downloads, who, media_type=MEDIA[path.suffix], inline=is_report)

    @app.get("/page/tables/{run_id}/{name}.csv", include_in_schema=False)
    def csv_table(run_id: RunNumber, name: str) -> Response:
        """One table of a run: SI units, decimals after a point."""
        if name not in TABLES:
            raise NotFoundError(f"there is no table {name}; there are {', '.join(TABLES)}")
        with services.catalogue.reading() as session:
            text = as_csv(TABLES[name](session, run_id))
        saved = {"Content-Disposition": f'attachment; filename="run-{run_id}-{name}.csv"'}
        return Response(text, media_type="text/csv", headers=saved)


def as_csv(rows: Rows) -> str:
    """Rows as CSV text; the first one is the head."""
    buffer = io.StringIO()
    csv.writer(buffer).writerows(rows)
    return buffer.getvalue()


def _modes(session: Session, run_id: int) -> Rows:
    modes = get_modes(session, latest_analysis(session, run_id, AnalysisKind.MODES).id)
    assert modes.frequency_ci95 is not None
    assert modes.loss_factor_ci95 is not None
    yield "mode", "frequency_hz", "low_hz", "high_hz", "loss_factor", "loss_factor_low", "loss_factor_high"
    for index, frequency in enumerate(modes.frequency):
        loss = modes.loss_factor[index], *modes.loss_factor_ci95[index]
        yield index + 1, frequency, *modes.frequency_ci95[index], *loss


def _joints(session: Session, run_id: int) -> Rows:
    analysis = latest_analysis(session, run_id, AnalysisKind.JOINT_MATRICES)
    yield "joint", "row", "column", "k", "k_low", "k_high", "h", "h_low", "h_high", "observable", "reason"
    for joint in list_joint_matrices(session, analysis.id):
        reasons = unobservable_reasons(analysis, joint.joint)
        for at in ((row, column) for row in range(3) for column in range(3)):
            k, h = (joint.stiffness[at], *joint.stiffness_ci95[at]), (joint.damping[at], *joint.damping_ci95[at])
            reason = reasons.get(f"k{at[0] + 1}{at[1] + 1}", "")
            yield joint.joint, at[0] + 1, at[1] + 1, *k, *h, bool(joint.observable[at]), reason


def _dynamic_stiffness(session: Session, run_id: int) -> Rows:
    points = list_dynamic_stiffness(session, latest_analysis(session, run_id, AnalysisKind.DYNAMIC_STIFFNESS).id)
    yield POINT_COLUMNS
    for point in points:
        yield tuple(getattr(point, name) for name in POINT_COLUMNS)


def _accelerances(session: Session, run_id: int) -> Rows:
    yield "set", "input", "response", "frequency_hz", "real", "imaginary", "coherence"
    for each in list_frequency_responses(session, run_id):
        for row, point in enumerate(each.inputs):
            for index, frequency in enumerate(each.frequency):
                value = each.accelerance[row, index]
                coherence = "" if each.coherence is None else each.coherence[row, index]
                yield each.number, point, each.response, frequency, value.real, value.imag, coherence


def _comparison(session: Session, run_id: int) -> Rows:
    yield "joint", "element", "inverse_low", "inverse_high", "direct_low", "direct_high", "verdict", "reason"
    for each in list_comparisons(session, latest_analysis(session, run_id, AnalysisKind.COMPARISONS).id):
        yield each.joint, each.element, *(each.inverse or ("", "")), *each.direct, each.verdict, each.reason


TABLES: Mapping[str, Callable[[Session, int], Rows]] = {
    "modes": _modes,
    "joints": _joints,
    "dynamic_stiffness": _dynamic_stiffness,
    "accelerances": _accelerances,
    "comparison": _comparison,
}
