"""Joint matrices by each inverse method, with intervals; what is not observable is greyed, with the reason."""

from __future__ import annotations

import numpy as np

from api.page.charts.axes import Real
from api.page.markup import Cell, Unknown, show, table
from api.page.results.section import Section, analyses_of, show_origin
from api.report.section import ends, number
from store.analyses import Analysis, AnalysisKind
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.joint_matrices import JointMatrix, list_joint_matrices
from store.runs import Run

AXES = ("x", "y", "rotation")
UNITS = (("N/m", "N/m", "N"), ("N/m", "N/m", "N"), ("N", "N", "N m"))
WHY = "not observable"
NEAR_ZERO = "k is near zero"
GREYED = (
    "Greyed elements are not observable: only a prior, or a sum with the other joint, determines them; or k is too "
    "near zero for a ratio to it."
)
Found = list[tuple[Analysis, list[JointMatrix]]]


def _read(catalogue: Catalogue, run: Run) -> Found:
    newest: dict[str, Analysis] = {}
    for analysis in analyses_of(catalogue, run, AnalysisKind.JOINT_MATRICES):
        newest.setdefault(analysis.method, analysis)
    if not newest:
        raise NotFoundError(f"run {run.id} has no joint matrices")
    with catalogue.reading() as session:
        return [(analysis, list_joint_matrices(session, analysis.id)) for analysis in newest.values()]


def _draw(_run: Run, found: Found) -> None:
    show(f"<p>Rows and columns are {', '.join(AXES)} at the joint's node. {GREYED}</p>")
    for analysis, joints in found:
        for joint in joints:
            where = f"joint {joint.joint}, node {joint.node}, {analysis.method}"
            show(matrix(f"k of {where}", "k", joint, joint.stiffness, joint.stiffness_ci95))
            show(matrix(f"h of {where}", "h", joint, joint.damping, joint.damping_ci95))
            show(matrix(f"γ of {where}", "γ", joint, joint.loss_factor, joint.loss_factor_ci95))
        show_origin(analysis)


def matrix(caption: str, symbol: str, joint: JointMatrix, value: Real, interval: Real) -> str:
    """One matrix as a table: each element with its unit and its 95 % interval."""
    rows = [
        (AXES[row], *(_cell(symbol, joint, value, interval, (row, column)) for column in range(3))) for row in range(3)
    ]
    return table(caption, ("", *AXES), rows)


def _cell(symbol: str, joint: JointMatrix, value: Real, interval: Real, at: tuple[int, int]) -> Cell:
    if symbol == "γ" and np.isnan(value[at]):
        return Unknown("–", NEAR_ZERO)
    unit = "" if symbol == "γ" else UNITS[at[0]][at[1]]
    text = f"{_number(value[at], unit)} [{_ends(interval[at], unit)}] {_mega(unit)}".strip()
    return text if joint.observable[at] else Unknown(text, WHY)


def _number(value: float, unit: str) -> str:
    return number(float(value) / _scale(unit))


def _ends(interval: Real, unit: str) -> str:
    return ends(interval / _scale(unit))


def _scale(unit: str) -> float:
    return {"N/m": 1e6, "N": 1e3, "N m": 1.0}.get(unit, 1.0)


def _mega(unit: str) -> str:
    return {"N/m": "MN/m", "N": "kN", "N m": "N m"}.get(unit, "")


SECTION = Section("Joints", "Press Identify: joints are found from accelerances and modes.", _read, _draw)
