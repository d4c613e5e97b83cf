"""What all charts share: axes with units, colours that colour-blind people can tell apart, numbers as people read them.

Keys that begin with a colon are evaluated in the browser, where page.js has `thin`.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointlab.report.plots import COLOURS, stroke

ChartOptions = dict[str, Any]
Real = NDArray[np.float64]
SYMBOLS = ("circle", "rect", "triangle", "diamond", "roundRect", "pin")
INK = "#1c1c1c"
KEY_OF_LINES, KEY_OF_DOTS = 25, 12  # px, width of what a legend shows of a line and of dots
ROW, MOST_ROWS = 26, 3  # px; of a legend
PHONE, KEY, CHARACTER = 350, 40, 7.2  # px: the width of a chart there, of a key with its gap, and of a character
DASH_DOT = [8, 4, 2, 4]  # px


def frequency_axis(frequency: Real) -> ChartOptions:
    """An axis from 0 to the last of (lines,) frequencies in Hz, and no further."""
    return axis("frequency (Hz)", low=0, high=float(frequency[-1]))


def phase_axis() -> ChartOptions:
    """An axis of all phases in degrees."""
    return axis("phase (°)", low=-180, high=180) | {"interval": 90}


def axis(name: str, *, log: bool = False, low: float | None = None, high: float | None = None) -> ChartOptions:
    """An axis called `name`, unit included."""
    made: ChartOptions = {
        "type": "log" if log else "value",
        "name": name,
        "nameLocation": "middle",
        "scale": True,
        "nameTextStyle": {"color": INK, "fontSize": 14},
        "axisLabel": {"color": INK, "fontSize": 13, ":formatter": "value => thin(value, 9)", "hideOverlap": True},
        "axisLine": {"show": True, "onZero": False},
        "splitLine": {"lineStyle": {"color": "#ddd"}},
    }
    return made | {key: value for key, value in (("min", low), ("max", high)) if value is not None}


def plot(
    series: Sequence[ChartOptions], x: ChartOptions, y: ChartOptions, *, legend: bool = True, zoom: bool = False
) -> ChartOptions:
    """One chart: series over one pair of axes.

    Its legend has as many rows as it needs on a phone. Where these are more than `MOST_ROWS`, it has pages.
    """
    shown: dict[str, ChartOptions] = {}
    for each in series:
        shown.setdefault(each["name"], each)  # bars have the name of their curve
    rows = _legend_rows(shown) if legend else 0
    pages = rows > MOST_ROWS
    return {
        "animation": False,
        "color": list(COLOURS),
        "textStyle": {"fontFamily": "system-ui, sans-serif"},
        "grid": {"left": 78, "right": 24, "top": 18 + ROW * (1 if pages else rows), "bottom": 56},
        "legend": {
            "show": legend,
            "top": 4,
            "data": [_legend_entry(each) for each in shown.values()],
            "itemWidth": KEY_OF_DOTS if all(each["type"] == "scatter" for each in series) else KEY_OF_LINES,
            "itemHeight": KEY_OF_DOTS,
            "type": "scroll" if pages else "plain",
            "inactiveColor": "#767676",
            "textStyle": {"fontSize": 13},
        },
        "tooltip": {"trigger": "axis", ":valueFormatter": "value => thin(value)", "confine": True},
        "xAxis": x | {"nameGap": 32},
        "yAxis": y | {"nameGap": 56},
        "dataZoom": [{"type": "inside"}] if zoom else [],
        "series": list(series),
    }


def low(made: ChartOptions) -> ChartOptions:
    """The same chart with less room around it: several low ones are seen at once while something is measured."""
    x, y = made["xAxis"] | {"nameGap": 24}, low_axis(made["yAxis"], made["series"])
    top = 34 if made["legend"]["show"] else 10
    return made | {"grid": made["grid"] | {"left": 72, "top": top, "bottom": 42}, "xAxis": x, "yAxis": y}


def low_axis(y: ChartOptions, series: Sequence[ChartOptions]) -> ChartOptions:
    """A vertical axis of a low chart for the data of `series`: four labels at most, so that none lies on another."""
    shown = y | {"nameGap": 52}
    values = np.array([value for each in series for _, value in each["data"] if value is not None])
    if "interval" in y or values.size == 0:
        return shown
    if y["type"] == "log":
        return shown | {"interval": max(1, math.ceil(np.ptp(np.log10(values)) / 3))}  # decades
    lowest, highest = y.get("min", float(np.min(values))), y.get("max", float(np.max(values)))
    if lowest == highest:
        return shown | {"splitNumber": 2}
    wanted = (highest - lowest) / 2
    power = 10.0 ** math.floor(math.log10(wanted))
    step = next(each * power for each in (1, 2, 5, 10) if each * power >= 0.999 * wanted)
    ends = math.floor(lowest / step + 1e-9) * step, math.ceil(highest / step - 1e-9) * step
    return shown | {"interval": step, "min": float(f"{ends[0]:.12g}"), "max": float(f"{ends[1]:.12g}")}


def _legend_entry(drawn: ChartOptions) -> ChartOptions:
    """What the legend shows of a series, as it is drawn: a band as an area, a bare line without a mark."""
    entry: ChartOptions = {"name": drawn["name"]}
    if "markArea" in drawn:
        return entry | {"icon": "rect"}
    return entry | ({"itemStyle": {"opacity": 0}} if drawn.get("symbol") == "none" else {})


def _legend_rows(names: Iterable[str]) -> int:
    """Rows of a legend on a phone, filled in order."""
    rows, used = 1, 0.0
    for name in names:
        width = KEY + CHARACTER * len(name)
        if used and used + width > PHONE:
            rows, used = rows + 1, 0.0
        used += width
    return rows


def line(name: str, x: Real, y: Real, **more: Any) -> ChartOptions:
    """A line without marks, which its legend does not have either."""
    return {
        "type": "line",
        "name": name,
        "showSymbol": False,
        "symbol": "none",
        "data": pairs(x, y),
        "lineStyle": {"width": 2},
    } | more


def line_style(colour: str, kind: str, width: float = 2) -> ChartOptions:
    """The style of a line, its kind named as in the report: solid, dashed, dotted or dashdot."""
    return {"color": colour, "lineStyle": {"width": width, "type": DASH_DOT if kind == "dashdot" else kind}}


def distinct_line(index: int, width: float) -> ChartOptions:
    """The style of curve `index` of many, which differ in colour and kind of line and have their names at the end."""
    colour, kind = stroke(index)
    label = {"show": True, "formatter": "{a}", "color": colour, "fontSize": 12, "distance": 3}
    return line_style(colour, kind, width) | {"endLabel": label}


def dots(name: str, x: Real, y: Real, **more: Any) -> ChartOptions:
    """Marks without a line."""
    return {"type": "scatter", "name": name, "symbolSize": 8, "data": pairs(x, y)} | more


def pairs(x: Real, y: Real) -> tuple[tuple[float | None, float | None], ...]:
    """Points as (x, y) to five digits; what is no number is a gap.

    Tuples, as NiceGUI watches every list of a chart for changes, which cost a third of a live view's time.
    """
    return tuple((_short(a), _short(b)) for a, b in zip(x.tolist(), y.tolist(), strict=True))


def thinned(x: Real, y: Real, most: int = 1200) -> tuple[Real, Real]:
    """At most `most` points of a record: the lowest and the highest of each of `most` / 2 pieces, in their order."""
    if y.size <= most:
        return x, y
    pieces = np.array_split(np.arange(y.size), most // 2)
    keep = sorted({index for piece in pieces for index in (piece[y[piece].argmin()], piece[y[piece].argmax()])})
    return x[keep], y[keep]


def _short(value: float) -> float | None:
    return float(f"{value:.5g}") if math.isfinite(value) else None
