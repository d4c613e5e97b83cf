"""The gap between measurement and simulation: where it lies, and how far an explanation closes it."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from api.page.charts.axes import INK, Options, axis, plot
from api.report.plots import BLUE, ORANGE

SCALE = ("#f7fbff", "#c6dbef", "#6baed6", "#2171b5", "#08306b")
"""From nothing to much; rising darkness, which every eye sees."""


def gap_map(drawn: Mapping[str, Any]) -> Options:
    """A map of misfit: rows over frequency bands, coloured by significance in standard deviations."""
    significance = np.array(drawn["significance"], dtype=float)
    edges = drawn["edges_hz"]
    bands = [f"{low:.0f}–{high:.0f}" for low, high in pairwise(edges)]
    cells = [
        [column, row, round(float(value), 1)]
        for row, values in enumerate(significance)
        for column, value in enumerate(values)
        if np.isfinite(value)
    ]
    labels = {"color": INK, "fontSize": 13}
    return {
        "animation": False,
        "grid": {"left": 150, "right": 24, "top": 12, "bottom": 112},
        "tooltip": {"confine": True},
        "xAxis": {"type": "category", "data": bands, "name": "band (Hz)", "nameLocation": "middle", "nameGap": 34}
        | {"axisLabel": labels, "nameTextStyle": labels},
        "yAxis": {"type": "category", "data": list(drawn["rows"]), "axisLabel": labels},
        "visualMap": {
            "min": 0,
            "max": max(float(np.nanmax(significance, initial=1.0)), 1.0),
            "calculable": True,
            "orient": "horizontal",
            "left": "center",
            "bottom": 4,
            "precision": 1,
            "text": ["standard deviations beyond noise", ""],
            "inRange": {"color": list(SCALE)},
        },
        "series": [{"type": "heatmap", "name": "significance", "data": cells}],
    }


def before_and_after(gap: Mapping[str, Any]) -> Options:
    """Gap in per cent before and after, overall and for each rig, with the interval of the after and the floor."""
    rows = {"overall": (gap["before"]["percent"], gap["after"]["percent"])}
    rows |= {rig: (found["before"], found["after"]) for rig, found in gap.get("by_rig", {}).items()}
    names = list(rows)
    made = plot(
        [
            {"type": "bar", "name": "before", "color": ORANGE, "data": [before for before, _ in rows.values()]},
            {"type": "bar", "name": "after", "color": BLUE, "data": [after for _, after in rows.values()]},
        ],
        axis("gap (%)", low=0),
        axis("") | {"type": "category", "data": names, "inverse": True},
    )
    made["yAxis"]["axisLabel"].pop(":formatter")
    made["grid"] |= {"left": 110}
    low, high = gap.get("after_ci90_percent") or (None, None)
    if low is not None and high is not None:
        area = [[{"xAxis": low, "name": "after, 90 %"}, {"xAxis": high}]]
        made["series"][1]["markArea"] = {"itemStyle": {"color": "#0072b233"}, "label": {"color": INK}, "data": area}
    if gap.get("floor_percent") is not None:
        floor = {"xAxis": gap["floor_percent"], "name": "floor"}
        made["series"][0]["markLine"] = {
            "symbol": "none",
            "lineStyle": {"color": INK, "type": "dashed", "width": 2},
            "label": {"formatter": "floor", "color": INK, "position": "insideMiddleTop"},
            "data": [floor],
        }
    return made
