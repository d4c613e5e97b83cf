"""Joint matrices by each inverse method, with intervals; what is not observable is greyed, with the reason."""

from __future__ import annotations

from api.identification.record import why_not_observable
from api.page.markup import paragraph, show, table
from api.page.results.section import Section, analyses_of, show_origin
from api.report.joint_matrices import READING, matrix_tables
from store.analyses import Analysis, AnalysisKind
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.joint_matrices import JointMatrix, list_joint_matrices
from store.runs import Run

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
    paragraph(READING)
    for analysis, joints in found:
        for joint in joints:
            for each in matrix_tables(joint, analysis.method, why_not_observable(analysis, joint.joint)):
                show(table(each.caption, each.head, each.rows))
        show_origin(analysis)


SECTION = Section("Joints", "Press Identify: joints are found from accelerances and modes.", _read, _draw)
