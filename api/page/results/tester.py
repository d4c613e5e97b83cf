"""The direct method: k and gamma of the cylinders over frequency for each amplitude, with their intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from nicegui import ui

from api.page.charts import sines
from api.page.controls import chart
from api.page.markup import paragraph, show
from api.page.results.section import Section, direct_where_known, newest_of, show_origin
from jointlab.identification.direct import Direct
from jointlab.report.curves import superposition_curves
from store.analyses import Analysis
from store.catalogue import Catalogue
from store.dynamic_stiffness import StoredStiffness, list_dynamic_stiffness
from store.runs import Run
from store.states import AnalysisKind

HALF_WIDTH = 1.96  # standard errors of a 95 % interval
Found = tuple[Analysis, list[StoredStiffness], dict[str, Direct]]


def _read(catalogue: Catalogue, run: Run) -> Found:
    newest = newest_of(catalogue, run, AnalysisKind.DYNAMIC_STIFFNESS, "dynamic stiffness")
    with catalogue.reading() as session:
        points = list_dynamic_stiffness(session, newest.id)
    return newest, points, direct_where_known(catalogue, run)


def _draw(_run: Run, found: Found) -> None:
    analysis, points, direct = found
    show(f"<p>{len(points)} sine points; bars are 95 % intervals. The legend hides and shows amplitudes.</p>")
    mountings = dict.fromkeys((point.specimen, point.configuration) for point in points)
    with ui.element("div").classes("cards"):
        for specimen, configuration in mountings:
            own = [point for point in points if (point.specimen, point.configuration) == (specimen, configuration)]
            where, name = f"joint {specimen} in {configuration}", f"{specimen}-{configuration}"
            k = curves(own, lambda p: p.stiffness / 1e6, lambda p: (p.stiffness_se or 0.0) / 1e6)
            chart(f"k, {where}", sines.with_intervals(k, "k (MN/m)", {}), f"k-{name}")
            gamma = curves(own, lambda p: p.loss_factor, lambda p: p.loss_factor_se or 0.0)
            chart(f"γ, {where}", sines.with_intervals(gamma, "γ", {}), f"gamma-{name}")
    for name, cylinders in direct.items():
        if checks := cylinders.superposition:
            caption = f"Fig. 12: joint {name}, superposition of the cylinders at 45 degrees"
            chart(caption, sines.superposition(*superposition_curves(checks)), f"fig-12-{name}")
            paragraph(" ".join(f"{amplitude:g} mm: {check.text}." for amplitude, check in checks.items()))
    flagged = [point for point in points if point.flags]
    if flagged:
        first = flagged[0]
        where = f"{first.specimen} in {first.configuration} at {first.frequency:g} Hz"
        paragraph(f"{len(flagged)} points have something to mind; the first, {where}: {first.flags[0]}.")
    show_origin(analysis)


def curves(
    points: Sequence[StoredStiffness],
    value: Callable[[StoredStiffness], float],
    error: Callable[[StoredStiffness], float],
) -> dict[float, sines.Banded]:
    """One curve for each amplitude, largest first, over rising frequency, with half-widths of 95 % intervals."""
    made = {}
    for amplitude in sorted({point.amplitude_pp_mm for point in points}, reverse=True):
        own = sorted((p for p in points if p.amplitude_pp_mm == amplitude), key=lambda point: point.frequency)
        made[amplitude] = (
            np.array([point.frequency for point in own]),
            np.array([value(point) for point in own]),
            np.array([HALF_WIDTH * error(point) for point in own]),
        )
    return made


SECTION = Section("Tester", "Press Identify: k and gamma are computed from the records of the sweep.", _read, _draw)
