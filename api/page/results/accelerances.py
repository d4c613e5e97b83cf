"""Accelerances and coherences as they were averaged."""

from __future__ import annotations

from nicegui import ui

from api.page.charts import modal
from api.page.controls import chart
from api.page.results.section import Section, analyses_of, show_origin
from store.analyses import Analysis, AnalysisKind
from store.catalogue import Catalogue
from store.frequency_responses import FrequencyResponseSet, list_frequency_responses
from store.runs import Run

Found = tuple[list[FrequencyResponseSet], Analysis]


def _read(catalogue: Catalogue, run: Run) -> Found:
    with catalogue.reading() as session:
        sets = list_frequency_responses(session, run.id)
    return sets, analyses_of(catalogue, run, AnalysisKind.FREQUENCY_RESPONSES)[0]


def _draw(_run: Run, found: Found) -> None:
    sets, analysis = found
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
    show_origin(analysis)


SECTION = Section("Accelerances", "Press Identify: the blows of each point are averaged then.", _read, _draw)
