"""Intervals of both methods side by side."""

from __future__ import annotations

from collections.abc import Sequence

from api.page.charts.axes import Options, axis, plot
from jointlab.report.plots import BLUE, ORANGE
from store.comparisons import Comparison


def intervals(compared: Sequence[Comparison], scale: float, unit: str) -> Options:
    """For each joint element the inverse and the direct 95 % interval, in `unit`, which is `scale` SI units."""
    names = [f"{each.element} {each.joint}" for each in compared]
    series = [
        {
            "type": "custom",
            "name": method,
            "color": colour,
            "encode": {"x": [1, 2], "y": 0},
            "data": [[index, low / scale, high / scale] for index, (low, high) in enumerate(ends)],
            # one bar from end to end, the two methods above and below the element's line
            ":renderItem": "(params, api) => { const a = api.coord([api.value(1), api.value(0)]), "
            "b = api.coord([api.value(2), api.value(0)]); return { type: 'rect', shape: { x: a[0], y: a[1] + "
            f"{offset}, width: Math.max(b[0] - a[0], 3), height: 10 }}, style: {{ fill: '{colour}' }} }} }}",
        }
        for method, colour, offset, ends in (
            ("inverse", BLUE, -12, [each.inverse for each in compared if each.inverse is not None]),
            ("direct", ORANGE, 2, [each.direct for each in compared]),
        )
    ]
    made = plot(series, axis(unit or "loss factor"), axis("") | {"type": "category", "data": names, "inverse": True})
    made["yAxis"]["axisLabel"].pop(":formatter")
    return made | {"tooltip": {"show": False}, "grid": made["grid"] | {"left": 110}}
