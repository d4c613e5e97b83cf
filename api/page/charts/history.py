"""A specimen over its runs."""

from collections.abc import Sequence
from datetime import datetime

from api.page.charts.axes import INK, ChartOptions, axis, plot
from jointlab.report.plots import BLUE

Ends = tuple[float | None, float | None]


def over_time(
    name: str, at: Sequence[datetime], value: Sequence[float | None], intervals: Sequence[Ends] = ()
) -> ChartOptions:
    """Values over the time of measuring (UTC), with 95 % intervals as bars; `name` is of the axis, unit included."""
    times = [1e3 * each.timestamp() for each in at]
    series: list[ChartOptions] = [
        {
            "type": "line",
            "name": name,
            "color": BLUE,
            "symbolSize": 9,
            "showSymbol": True,
            "lineStyle": {"width": 1, "type": "dotted"},
            "data": tuple(zip(times, value, strict=True)),
        }
    ]
    bars = tuple(
        (time, end)
        for time, (low, high) in zip(times, intervals, strict=bool(intervals))
        if low is not None
        for end in (low, high, None)
    )
    if bars:
        quiet = {"showSymbol": False, "tooltip": {"show": False}, "silent": True, "lineStyle": {"width": 2}}
        series.append({"type": "line", "name": name, "color": BLUE, "data": bars} | quiet)
    label = {"color": INK, "fontSize": 13, "hideOverlap": True}
    return plot(series, axis("measured") | {"type": "time", "axisLabel": label}, axis(name), legend=False)
