"""Accelerances and coherences as they were averaged."""

from __future__ import annotations

from nicegui import ui

from api.page.charts import inverse as charts
from api.page.charts import modal
from api.page.controls import chart
from api.page.results.section import Section, analyses_of, inverse_where_known, show_origin
from jointlab.identification.read import StoredInverse
from jointlab.report.curves import FIGURED_POINTS
from store.analyses import Analysis
from store.catalogue import Catalogue
from store.frequency_responses import FrequencyResponseSet, list_frequency_responses
from store.runs import Run
from store.states import AnalysisKind

Found = tuple[list[FrequencyResponseSet], Analysis, StoredInverse | None]


def _read(catalogue: Catalogue, run: Run) -> Found:
    with catalogue.reading() as session:
        sets = list_frequency_responses(session, run.id)
    analysis = analyses_of(catalogue, run, AnalysisKind.FREQUENCY_RESPONSES)[0]
    return sets, analysis, inverse_where_known(catalogue, run)


def _draw(_run: Run, found: Found) -> None:
    sets, analysis, inverse = found
    for each in sets:
        names = [f"{point} → {each.response}" for point in each.inputs]
        title = f"Set {each.number}, {each.averages} blows a point; the legend shows other points"
        magnitude = modal.accelerances(each.frequency, each.accelerance, names)
        chart(f"{title}: accelerance", magnitude, f"accelerance-{each.number}", height="24rem")
        with ui.element("div").classes("cards"):
            phase = modal.accelerances(each.frequency, each.accelerance, names, phase=True)
            chart("Phase", phase, f"phase-{each.number}")
            if each.coherence is not None:
                chart("Coherence", modal.coherences(each.frequency, each.coherence, names), f"coherence-{each.number}")
    if inverse is not None:
        _measured_and_predicted(inverse)
    show_origin(analysis)


def _measured_and_predicted(inverse: StoredInverse) -> None:
    """Figs. 7 to 9, of the points that were struck."""
    for label, point in FIGURED_POINTS:
        if point in inverse.measured.inputs:
            where = f"accelerance at {inverse.measured.response} for a blow at {point}"
            shown, name = (inverse.measured, inverse.predicted, point), label.replace(". ", "-").lower()
            chart(f"{label}: {where}", charts.measured_and_predicted(*shown), name, height="24rem")
            chart(f"{label}, phase: {where}", charts.measured_and_predicted(*shown, phase=True), f"{name}-phase")


SECTION = Section("Accelerances", "Press Identify: the blows of each point are averaged then.", _read, _draw)
