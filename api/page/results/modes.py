"""Modes: the stabilisation chart, the table with intervals, and the shapes as they swing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.modal.stabilisation import Stabilisation
from api.page.charts import modal
from api.page.controls import chart
from api.page.markup import show, table
from api.page.results.section import Section, analyses_of, show_origin
from jointlab.identification.inverse import stabilisation_of
from jointlab.identification.measurement import responses_of
from jointlab.report.section import ends, number
from store.analyses import Analysis
from store.bundle_setup import article_from
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.frequency_responses import FrequencyResponseSet, list_frequency_responses
from store.modes import ModeSet, get_modes
from store.runs import Run
from store.states import AnalysisKind


@dataclass(frozen=True, eq=False)
class FoundModes:
    """The newest modes of a run, with the accelerances and the chart they were chosen from."""

    analysis: Analysis
    modes: ModeSet
    measured: FrequencyResponseSet | None
    chart: Stabilisation | None


def _read(catalogue: Catalogue, run: Run) -> FoundModes:
    analyses = analyses_of(catalogue, run, AnalysisKind.MODES)
    if not analyses:
        raise NotFoundError(f"run {run.id} has no modes")
    with catalogue.reading() as session:
        modes = get_modes(session, analyses[0].id)
        try:
            measured = list_frequency_responses(session, run.id)[0]
        except NotFoundError:
            measured = None
    return FoundModes(
        analyses[0], modes, measured, None if measured is None else stabilisation_of(responses_of(measured))
    )


def _draw(run: Run, found: FoundModes) -> None:
    modes = found.modes
    if found.chart is not None and found.measured is not None:
        shown = found.measured.frequency > 0
        total = np.abs(found.measured.accelerance[:, shown]).sum(axis=0)
        options = modal.stabilisation(found.chart, found.measured.frequency[shown], total, modes.frequency)
        chart("Stabilisation: poles of every model order; lines are the modes that were kept", options, "stabilisation")
    assert modes.frequency_ci95 is not None
    assert modes.loss_factor_ci95 is not None
    assert modes.predicted_frequency is not None
    rows = [
        (
            str(index + 1),
            number(modes.frequency[index], 6),
            ends(modes.frequency_ci95[index], 6),
            number(modes.predicted_frequency[index], 6),
            number(modes.loss_factor[index]),
            ends(modes.loss_factor_ci95[index]),
        )
        for index in range(modes.frequency.size)
    ]
    head = ("mode", "frequency (Hz)", "95 %", "predicted (Hz)", "loss factor", "95 %")
    show(table("Modes", head, rows))
    show(f'<div class="cards">{"".join(_shapes(run, modes))}</div>')
    show_origin(found.analysis)


def _shapes(run: Run, modes: ModeSet) -> list[str]:
    positions = article_from(run.setup).node_positions
    across = [column for column, dof in enumerate(modes.dofs) if dof.direction == "y"]
    if len(across) < 2:
        return ["<p>Fewer than two points across the beam: there is no shape to draw.</p>"]
    x = np.array([positions[modes.dofs[column].node - 1] for column in across])
    return [
        modal.moving_shape(modal.mode_name(index, frequency), x, modes.shapes[index, across], positions[-1])
        for index, frequency in enumerate(modes.frequency)
    ]


SECTION = Section("Modes", "Press Identify: modes are found from the blows of the hammer session.", _read, _draw)
