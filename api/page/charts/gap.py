"""The gap between measurement and simulation: where it lies, and how far an explanation closes it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from api.page.charts.axes import INK, ChartOptions, axis, dots, line, phase_axis, plot
from jointlab.diagnosis.law_text import COORDINATES, places
from jointlab.diagnosis.wording import RIGS
from jointlab.report.gap_figures import LAW_STYLES, SHAPE_AXES, law_labels
from jointlab.report.gap_tables import SIGNIFICANT
from jointlab.report.plots import BLACK, BLUE, ORANGE

SCALE = ("#f7fbff", "#c6dbef", "#6baed6", "#2171b5", "#08306b")
"""Colours from none to much, ever darker, so that colour-blind people see the order."""


@dataclass(frozen=True)
class Quantity:
    """A quantity of a curve: its title, its axis with unit, and whether it is logarithmic or has jumps."""

    title: str
    axis: str
    log: bool = False
    jumps: bool = False
    scale: float = 1.0


QUANTITIES = {
    "magnitude": Quantity("Accelerance", "|A| ((m/s²)/N)", log=True),
    "phase_deg": Quantity("Phase", "phase (°)", jumps=True),
    "stiffness": Quantity("Stiffness k", "k (MN/m)", scale=1e-6),
    "loss_factor": Quantity("Loss factor γ", "γ"),
}
"""By their names in a diagnosis's curves."""
STYLES = {
    "measured": (BLACK, 4.0, "solid", "circle", 0.4),
    "before": (ORANGE, 2.0, "dashed", "rect", 1.0),
    "after": (BLUE, 1.6, "solid", "triangle", 1.0),
}
"""Colour, width, kind of line, mark and opacity: distinguished without colour, and seen where they coincide."""


def over_each_other(curve: Mapping[str, Any], name: str, band: Sequence[float] | None = None) -> ChartOptions:
    """One quantity of a curve: measured as a broad grey line, the model before dashed, and after, over frequency.

    Args:
        name: of `QUANTITIES`.
        band: Hz, of a closer look, on an even scale; by default all there is.
    """
    quantity, frequency = QUANTITIES[name], np.array(curve["frequency_hz"], dtype=float)
    low, high = band or (0.0, float(frequency[-1]))
    shown = (frequency >= low) & (frequency <= high)
    series = []
    for moment, (colour, width, kind, mark, opacity) in STYLES.items():
        values = quantity.scale * np.array(curve[name][moment], dtype=float)[shown]
        if quantity.jumps:
            style = {"itemStyle": {"opacity": opacity}, "symbol": mark}
            series.append(dots(moment, frequency[shown], values, color=colour, symbolSize=2 + width, **style))
        else:
            stroke = {"width": width, "type": kind, "opacity": opacity}
            series.append(line(moment, frequency[shown], values, color=colour, lineStyle=stroke, symbol="none"))
    scale = phase_axis() if quantity.jumps else axis(quantity.axis, log=quantity.log and band is None)
    return plot(series, axis("frequency (Hz)", low=low, high=high), scale, zoom=True)


def shape(curve: Mapping[str, Any], part: str) -> ChartOptions:
    """The real or imaginary part of a function that would take up what is left, between the ends of its 90 % band."""
    at, (low, high) = np.array(curve["at"], dtype=float), curve[f"{part}_ci90"]
    series = [
        line(name, at, np.array(values, dtype=float), color=BLUE, symbol="none", lineStyle={"width": 1.6, "type": kind})
        for name, values, kind in (("function", curve[part], "solid"), ("low", low, "dashed"), ("high", high, "dashed"))
    ]
    return plot(series, axis(SHAPE_AXES[curve["over"]]), axis(f"{part} part ({curve['unit']})"), zoom=True)


def law(found: Mapping[str, Any], quantity: str) -> ChartOptions:
    """Stiffness or loss factor of a law of the joints as found, along both axes, between the ends of its 90 % band."""
    coordinate, at = COORDINATES[found["over"]], np.array(places(found))
    series = []
    for name, (colour, kind) in LAW_STYLES.items():
        band = found[name][quantity]
        drawn = (name, band["value"], kind, 2.0), *((f"{name}, 90 %", end, "dotted", 1.2) for end in band["ci90"])
        for label, values, stroke, width in drawn:
            style = {"width": width, "type": stroke}
            series.append(line(label, at, np.array(values, dtype=float), color=colour, lineStyle=style))
    return plot(series, axis(coordinate.axis, log=coordinate.log), axis(law_labels(found)[quantity]), zoom=True)


def gap_map(drawn: Mapping[str, Any]) -> ChartOptions:
    """A map of misfit: rows over frequency bands, coloured by share of all misfit beyond noise that is significant."""
    energy = np.maximum(np.array(drawn["energy"], dtype=float), 0.0)
    certain = np.array(drawn["significance"], dtype=float) >= SIGNIFICANT
    share = 100 * energy / max(float(energy.sum()), np.finfo(float).tiny)
    bands = [f"{low:.0f}–{high:.0f}" for low, high in pairwise(drawn["edges_hz"])]
    cells = [[int(column), int(row), round(float(share[row, column]), 1)] for row, column in np.argwhere(certain)]
    labels = {"color": INK, "fontSize": 13}
    return {
        "animation": False,
        "grid": {"left": 150, "right": 24, "top": 12, "bottom": 112},
        "tooltip": {"confine": True},
        "xAxis": {"type": "category", "data": bands, "name": "band (Hz)", "nameLocation": "middle", "nameGap": 34}
        | {"axisLabel": labels, "nameTextStyle": labels},
        "yAxis": {"type": "category", "data": list(drawn["rows"]), "axisLabel": labels, "inverse": True},
        "visualMap": {
            "min": 0,
            "max": max([1.0, *(cell[2] for cell in cells)]),
            "calculable": True,
            "orient": "horizontal",
            "left": "center",
            "bottom": 4,
            "precision": 1,
            "text": ["% of all misfit beyond noise", ""],
            "inRange": {"color": list(SCALE)},
        },
        "series": [{"type": "heatmap", "name": "share, %", "data": cells}],
    }


def before_and_after(gap: Mapping[str, Any]) -> ChartOptions:
    """Gap in per cent of each rig before and after; interval of the after of the first rig, and floor."""
    rows = {RIGS[rig]: (found["before"], found["after"]) for rig, found in gap["by_rig"].items()}
    series = [_bars("before", ORANGE, [before for before, _ in rows.values()])]
    series.append(_bars("after", BLUE, [after for _, after in rows.values()]))
    low, high = gap.get("after_ci90_percent") or (None, None)
    if low is not None and high is not None:
        area = {"itemStyle": {"color": f"{BLUE}33"}, "data": [[{"xAxis": low}, {"xAxis": high}]]}
        series.append({"type": "line", "name": "90 % interval", "data": [], "color": f"{BLUE}55", "markArea": area})
    if gap.get("floor_percent") is not None:
        stroke = {"color": INK, "type": "dashed", "width": 2}
        mark = {
            "symbol": "none",
            "label": {"show": False},
            "lineStyle": stroke,
            "z": 1,
            "data": [{"xAxis": gap["floor_percent"]}],
        }
        name = "floor: measuring again"
        series.append({"type": "line", "name": name, "data": [], "color": INK, "lineStyle": stroke, "markLine": mark})
    made = plot(series, axis("gap (%)", low=0), axis("") | {"type": "category", "data": list(rows), "inverse": True})
    made["yAxis"]["axisLabel"].pop(":formatter")
    made["grid"] |= {"left": 130, "right": 64}
    return made


def _bars(name: str, colour: str, values: Sequence[float | None]) -> ChartOptions:
    digits = [None if value is None else float(f"{value:.3g}") for value in values]
    shown = {
        "show": True,
        "position": "right",
        "color": INK,
        "fontSize": 13,
        "backgroundColor": "#fffd",
        ":formatter": "each => `${thin(each.value)} %`",
    }
    return {"type": "bar", "name": name, "color": colour, "data": digits, "label": shown}
