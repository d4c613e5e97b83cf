"""Curves of a diagnosis: a row of the beam or a series of the tester, measured, before and after."""

from collections.abc import Mapping, Sequence
from typing import Any

from nicegui import ui

from api.page.charts.gap import QUANTITIES, over_each_other
from api.page.controls import chart, choice
from api.page.markup import paragraph
from jointlab.diagnosis import wording


def gap_curves(curves: Sequence[Mapping[str, Any]]) -> None:
    """Build the list and the charts of its first entry; only the chosen curve is sent to the browser."""
    if not curves:
        paragraph("This diagnosis has no curves with it; diagnose the run again to see them.", "quiet")
        return
    paragraph(wording.CURVES_NOTE, "quiet")
    offered = {str(number): wording.curve_words(curve) for number, curve in enumerate(curves)}
    choice("Measured, before and after at", "curve", offered, lambda value: draw(int(value)))
    place = ui.element("div").classes("w-full")

    def draw(number: int) -> None:
        place.clear()
        with place:
            _charts(curves[number])

    draw(0)


def _charts(curve: Mapping[str, Any]) -> None:
    place = wording.place_words(curve)
    first, second = [name for name in QUANTITIES if name in curve]
    chart(f"{QUANTITIES[first].title}: {place}", over_each_other(curve, first), "gap-curves", height="24rem")
    with ui.element("div").classes("cards"):
        if band := curve.get("close_up_hz"):
            title = f"Where they differ most: {band[0]:.0f} to {band[1]:.0f} Hz"
            chart(title, over_each_other(curve, first, band), "gap-close-up", height="19rem")
        title = QUANTITIES[second].title
        chart(f"{title}: {place}", over_each_other(curve, second), f"gap-{second.replace('_', '-')}", height="19rem")
