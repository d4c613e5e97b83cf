"""Joint matrices by each inverse method, with intervals; what is not observable is greyed, with the reason."""

from __future__ import annotations

from api.page.charts import inverse as charts
from api.page.controls import chart
from api.page.markup import paragraph, show, table
from api.page.results.section import Section, inverse_where_known, show_origin
from jointlab.identification.read import StoredInverse, newest_joints
from jointlab.identification.save import unobservable_reasons
from jointlab.report.joint_matrices import READING, matrix_tables
from store.analyses import Analysis
from store.catalogue import Catalogue
from store.joint_matrices import JointMatrix
from store.runs import Run

Found = tuple[list[tuple[Analysis, dict[str, JointMatrix]]], StoredInverse | None]


def _read(catalogue: Catalogue, run: Run) -> Found:
    return list(newest_joints(catalogue, run).values()), inverse_where_known(catalogue, run)


def _draw(_run: Run, found: Found) -> None:
    paragraph(READING)
    by_method, inverse = found
    for analysis, joints in by_method:
        for joint in joints.values():
            for each in matrix_tables(joint, analysis.method, unobservable_reasons(analysis, joint.joint)):
                show(table(each.caption, each.head, each.rows))
        show_origin(analysis)
    if inverse is not None:
        caption = "Fig. 5: equations of the paper's method, observed against curve-fitted"
        chart(caption, charts.regression(inverse.regressions), "fig-5", height="24rem")


SECTION = Section("Joints", "Press Identify: joints are found from accelerances and modes.", _read, _draw)
