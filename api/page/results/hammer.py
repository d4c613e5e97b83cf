"""Results of the hammer session: modes, accelerances and joint matrices."""

from dataclasses import dataclass

import numpy as np
from nicegui import ui

from analysis.modal.stabilisation import Stabilisation
from api.page.charts import hammer as charts
from api.page.controls import chart
from api.page.markup import paragraph, show, show_table
from api.page.results.part import Part, analyses_of, newest_of, show_origin, where_known
from jointlab.identification.inverse import stabilisation_of
from jointlab.identification.measurement import responses_of
from jointlab.identification.read import StoredInverse, newest_joints, read_inverse
from jointlab.identification.save import OVER_FREQUENCY, unobservable_reasons
from jointlab.report.curves import figured_points
from jointlab.report.tables import READING, matrix_tables, modes_table, over_frequency_tables
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.exchange.bundle_setup import article_from
from store.measurements.frequency_responses import FrequencyResponseSet, list_frequency_responses
from store.measurements.runs import Run
from store.results.analyses import Analysis
from store.results.joint_matrices import JointMatrix
from store.results.modes import ModeSet, get_modes
from store.states import AnalysisKind


@dataclass(frozen=True, eq=False)
class FoundModes:
    """The newest modes of a run, with the accelerances and the chart they were chosen from."""

    analysis: Analysis
    modes: ModeSet
    measured: FrequencyResponseSet | None
    chart: Stabilisation | None


def _read_modes(catalogue: Catalogue, run: Run) -> FoundModes:
    newest = newest_of(catalogue, run, AnalysisKind.MODES, "modes")
    with catalogue.reading() as session:
        modes = get_modes(session, newest.id)
        try:
            measured = list_frequency_responses(session, run.id)[0]
        except NotFoundError:
            return FoundModes(newest, modes, None, None)
    return FoundModes(newest, modes, measured, stabilisation_of(responses_of(measured)))


def _draw_modes(run: Run, found: FoundModes) -> None:
    modes = found.modes
    if found.chart is not None and found.measured is not None:
        shown = found.measured.frequency > 0
        total = np.abs(found.measured.accelerance[:, shown]).sum(axis=0)
        options = charts.stabilisation(found.chart, found.measured.frequency[shown], total, modes.frequency)
        chart("Stabilisation: poles of every model order; lines are the modes that were kept", options, "stabilisation")
    show_table(modes_table(modes, found.analysis.settings.get("fit")))
    show(f'<div class="cards">{"".join(_shapes(run, modes))}</div>')
    show_origin(found.analysis)


def _shapes(run: Run, modes: ModeSet) -> list[str]:
    positions = article_from(run.setup).node_positions
    across = [column for column, dof in enumerate(modes.dofs) if dof.direction == "y"]
    if len(across) < 2:
        return ["<p>Fewer than two points across the beam: there is no shape to draw.</p>"]
    x = np.array([positions[modes.dofs[column].node - 1] for column in across])
    return [
        charts.moving_shape(charts.mode_name(index, frequency), x, modes.shapes[index, across], positions[-1])
        for index, frequency in enumerate(modes.frequency)
    ]


FoundAccelerances = tuple[list[FrequencyResponseSet], Analysis, StoredInverse | None]


def _read_accelerances(catalogue: Catalogue, run: Run) -> FoundAccelerances:
    sets = catalogue.read(list_frequency_responses, run.id)
    analysis = analyses_of(catalogue, run, AnalysisKind.FREQUENCY_RESPONSES)[0]
    return sets, analysis, where_known(read_inverse, catalogue, run)


def _draw_accelerances(_run: Run, found: FoundAccelerances) -> None:
    sets, analysis, inverse = found
    for each in sets:
        names = [f"{point} → {each.response}" for point in each.inputs]
        title = f"Set {each.number}, {each.averages} blows a point; the legend shows other points"
        magnitude = charts.accelerances(each.frequency, each.accelerance, names)
        chart(f"{title}: accelerance", magnitude, f"accelerance-{each.number}", height="24rem")
        with ui.element("div").classes("cards"):
            phase = charts.accelerances(each.frequency, each.accelerance, names, phase=True)
            chart("Phase", phase, f"phase-{each.number}")
            if each.coherence is not None:
                coherence = charts.coherences(each.frequency, each.coherence, names)
                chart("Coherence", coherence, f"coherence-{each.number}")
    if inverse is not None:
        _measured_and_predicted(inverse)
    show_origin(analysis)


def _measured_and_predicted(inverse: StoredInverse) -> None:
    """Figs. 7 to 9, of the points that were struck."""
    for label, point in figured_points(inverse.measured):
        where = f"accelerance at {inverse.measured.response} for a blow at {point}"
        shown, name = (inverse.measured, inverse.predicted, point), label.replace(". ", "-").lower()
        chart(f"{label}: {where}", charts.measured_and_predicted(*shown), name, height="24rem")
        chart(f"{label}, phase: {where}", charts.measured_and_predicted(*shown, phase=True), f"{name}-phase")


FoundJoints = tuple[list[tuple[Analysis, dict[str, JointMatrix]]], StoredInverse | None]


def _read_joints(catalogue: Catalogue, run: Run) -> FoundJoints:
    return list(newest_joints(catalogue, run).values()), where_known(read_inverse, catalogue, run)


def _draw_joints(_run: Run, found: FoundJoints) -> None:
    paragraph(READING)
    by_method, inverse = found
    for analysis, joints in by_method:
        for joint in joints.values():
            for each in matrix_tables(joint, analysis.method, unobservable_reasons(analysis, joint.joint)):
                show_table(each)
        for table in over_frequency_tables(analysis.settings.get(OVER_FREQUENCY, {})):
            show_table(table)
        show_origin(analysis)
    if inverse is None:
        return
    if inverse.paper_left_out:
        paragraph(f"{inverse.paper_left_out}.")
    else:
        caption = "Fig. 5: equations of the paper's method, observed against curve-fitted"
        chart(caption, charts.regression(inverse.regressions), "fig-5", height="24rem")


MODES = Part(
    "Modes",
    "Press Identify: modes are found from the blows of the hammer session.",
    "hammer",
    _read_modes,
    _draw_modes,
)
ACCELERANCES = Part(
    "Accelerances",
    "Press Identify: the blows of each point are averaged then.",
    "hammer",
    _read_accelerances,
    _draw_accelerances,
)
JOINTS = Part(
    "Joints",
    "Press Identify: joints are found from accelerances and modes.",
    "hammer",
    _read_joints,
    _draw_joints,
)
