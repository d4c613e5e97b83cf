"""Sine points: signals, amplitudes reached, k and gamma over frequency, and intervals of both experiments."""

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from api.page.charts.axes import (
    SYMBOLS,
    ChartOptions,
    Real,
    axis,
    dots,
    line,
    line_style,
    low,
    low_axis,
    pairs,
    plot,
    thinned,
)
from jointlab.report.curves import Ends, Panel, PlottedCurve, from_common, panel_colours
from jointlab.report.plots import AMPLITUDE_COLOURS, AMPLITUDE_STYLES, BLUE, ORANGE, amplitude_styles
from jointlab.supervision.sweep_progress import Signals

SAMPLES_SHOWN = 300  # of a loop
Look = tuple[str, str]
"""Colour and kind of a line."""
NO_LOOKS: Mapping[str, Look] = MappingProxyType({})
NO_BANDS: Mapping[str, tuple[str, Ends]] = MappingProxyType({})
BAR = 12  # px, of an interval with the gap behind it


def signals(time: Real, displacement: Real, force: Real) -> ChartOptions:
    """Displacement in m and force in N over time in s, as a technician's oscilloscope shows them."""
    millis = 1e3 * time
    moved = line("displacement", *thinned(millis, 1e3 * displacement), color=BLUE)
    pushed = line("force", *thinned(millis, force), color=ORANGE, yAxisIndex=1)
    made = low(plot([moved, pushed], axis("time (ms)"), axis("displacement (mm)")))
    left = low_axis(axis("displacement (mm)"), [moved])
    right = low_axis(axis("force (N)"), [pushed]) | {"splitLine": {"show": False}}
    return made | {"yAxis": [left, right], "grid": made["grid"] | {"right": 82}}


def loop(signals: Signals) -> ChartOptions:
    """Force in N over displacement in mm: the mean cycle of the latest record, and the samples of its last cycles."""
    stride = max(1, signals.time.size // SAMPLES_SHOWN)
    moved, pushed = 1e3 * signals.displacement[::stride], signals.force[::stride]
    series = [dots("last cycles", moved, pushed, color=ORANGE, symbolSize=4)]
    if signals.loop is not None:
        level = float(np.mean(moved)), float(np.mean(pushed))
        cycle = 1e3 * signals.loop.displacement + level[0], signals.loop.force + level[1]
        series.append(line("mean cycle", *cycle, color=BLUE))
    made = plot(series, axis("displacement (mm)"), axis("force (N)"))
    return made | {"tooltip": {"trigger": "item", "confine": True}}


def amplitudes(reached: Mapping[float, PlottedCurve]) -> ChartOptions:
    """Amplitude reached over amplitude asked, by the amplitude asked in mm peak to peak."""
    series = [
        dots(f"{asked:g} mm", curve.frequency, curve.value, color=colour, symbol=symbol)
        for (asked, curve), colour, symbol in zip(reached.items(), AMPLITUDE_COLOURS * 9, SYMBOLS * 9, strict=False)
    ]
    return plot(series, axis("frequency (Hz)"), axis("reached / asked"))


def over_frequency(
    curves: Mapping[str, PlottedCurve],
    name: str,
    scale: float = 1.0,
    looks: Mapping[str, Look] = NO_LOOKS,
    bands: Mapping[str, tuple[str, Ends]] = NO_BANDS,
) -> ChartOptions:
    """Something over frequency: a line for each curve, with 95 % intervals as bars.

    Args:
        curves: by what the legend calls them; one without intervals has no bars.
        name: of the axis, unit included.
        scale: by which values, intervals and bands are divided.
        looks: colour and kind of line by curve; by default those of amplitudes, the largest first.
        bands: colour and interval across the chart that another method gives, by its name.
    """
    series: list[ChartOptions] = []
    bars: list[ChartOptions] = []
    for (title, curve), style, symbol in zip(curves.items(), AMPLITUDE_STYLES * 9, SYMBOLS * 9, strict=False):
        colour, kind = looks.get(title, style)
        value = curve.value / scale
        mark = {"showSymbol": True, "symbol": symbol, "symbolSize": 7}
        series.append(line(title, curve.frequency, value, **mark, **line_style(colour, kind)))
        if not np.isnan(curve.half_width).all():
            bars.append(_bars(title, curve.frequency, value, curve.half_width / scale, colour))
    series += bars
    for method, (colour, (lower, upper)) in bands.items():
        area = {
            "itemStyle": {"color": colour, "opacity": 0.2},
            "data": [[{"yAxis": lower / scale}, {"yAxis": upper / scale}]],
        }
        series.append({"type": "line", "name": method, "data": [], "color": colour, "markArea": area})
    made = plot(series, axis("frequency (Hz)"), axis(name), zoom=True)
    if bands:  # a band alone does not stretch the axis
        ends = [end / scale for _, band in bands.values() for end in band]
        extremes = [end(curve.value) / scale for curve in curves.values() for end in (np.min, np.max)]
        values = [*ends, *map(float, extremes)]
        room = 0.08 * (max(values) - min(values))
        made["yAxis"] |= {"min": float(f"{min(values) - room:.3g}"), "max": float(f"{max(values) + room:.3g}")}
    return made


def by_amplitude_words(curves: Mapping[float, PlottedCurve]) -> dict[str, PlottedCurve]:
    """Curves by amplitude in mm peak to peak as their legend calls them."""
    return {f"{amplitude:g} mm": curve for amplitude, curve in curves.items()}


def amplitude_looks(by_amplitude: Iterable[Iterable[float]]) -> dict[str, Look]:
    """Colour and kind of line of every amplitude of several charts, by its name in legends; the report has the same."""
    return {f"{amplitude:g} mm": style for amplitude, style in amplitude_styles(by_amplitude).items()}


def panels(drawn: Sequence[Panel], name: str, scale: float = 1.0) -> list[tuple[str, ChartOptions]]:
    """Fig. 13 or 14: title and chart of each panel, direct points with intervals, and inverse intervals across.

    A method and an amplitude have the same colour in all of them, and in the report.
    """
    methods, amplitudes = panel_colours(drawn)
    looks = {f"tester, {amplitude:g} mm": (colour, "solid") for amplitude, colour in amplitudes.items()}
    return [
        (
            each.title,
            over_frequency(
                {f"tester, {amplitude:g} mm": curve for amplitude, curve in sorted(each.curves.items())},
                name,
                scale,
                looks,
                {
                    method: (methods[method], (float(interval[0]), float(interval[1])))
                    for method, interval in each.inverse.items()
                },
            ),
        )
        for each in drawn
    ]


def superposition(computed: Mapping[float, PlottedCurve], measured: Mapping[float, PlottedCurve]) -> ChartOptions:
    """Fig. 12: |k| of the angled pair, measured as lines, computed from compression and shear as marks."""
    series = []
    styles = amplitude_styles((measured,))
    for (amplitude, (colour, kind)), symbol in zip(styles.items(), SYMBOLS * 9, strict=False):
        drawn = measured[amplitude]
        series.append(
            line(f"measured, {amplitude:g} mm", drawn.frequency, drawn.value / 1e6, **line_style(colour, kind))
        )
        sums = computed[amplitude]
        mark = {"color": colour, "symbol": symbol}
        series.append(dots(f"computed, {amplitude:g} mm", sums.frequency, sums.value / 1e6, **mark))
    return plot(series, axis("frequency (Hz)"), axis("|k| (MN/m)", low=0), zoom=True)


def _bars(name: str, frequency: Real, value: Real, half: Real, colour: str) -> ChartOptions:
    """Intervals as one broken line, which draws hundreds of bars at no cost."""
    x = np.repeat(frequency, 3)
    y = np.stack([value - half, value + half, np.full_like(value, np.nan)], axis=1).ravel()
    return {
        "type": "line",
        "name": name,
        "data": pairs(x, y),
        "showSymbol": False,
        "color": colour,
        "lineStyle": {"width": 1.5, "opacity": 0.7},
        "tooltip": {"show": False},
        "silent": True,
    }


def by_amplitude(rows: Sequence[tuple[float, float, float]]) -> dict[float, PlottedCurve]:
    """Rows of amplitude, frequency and value as one curve for each amplitude, over rising frequency."""
    found: dict[float, list[tuple[float, float]]] = {}
    for amplitude, frequency, value in rows:
        found.setdefault(amplitude, []).append((frequency, value))
    made = {}
    for amplitude, points in sorted(found.items(), reverse=True):
        frequency, values = np.array(sorted(points), dtype=float).T
        made[amplitude] = PlottedCurve(frequency, values, np.full_like(values, np.nan))
    return made


def intervals(rows: Mapping[str, Mapping[str, Ends]], colours: Mapping[str, str]) -> ChartOptions:
    """For each row the intervals of several ways to find it, in per cent of their common estimate.

    Args:
        rows: by name, both ends of an interval by way; no row is empty.
        colours: of the ways, in the order in which they stand below each other.
    """
    relative = {name: from_common(ends) for name, ends in rows.items()}
    series = []
    for place, (way, colour) in enumerate(colours.items()):
        offset = BAR * (place - len(colours) / 2) + 1
        data = [[index, *ends[way]] for index, ends in enumerate(relative.values()) if way in ends]
        # one bar from end to end, the ways above and below the middle of the row
        item = (
            "(params, api) => { const a = api.coord([api.value(1), api.value(0)]), "
            "b = api.coord([api.value(2), api.value(0)]); return { type: 'rect', shape: { x: a[0], y: a[1] + "
            f"{offset:g}, width: Math.max(b[0] - a[0], 3), height: {BAR - 2} }}, style: {{ fill: '{colour}' }} }} }}"
        )
        made = {"type": "custom", "name": way, "color": colour, "encode": {"x": [1, 2], "y": 0}, "data": data}
        series.append(made | {":renderItem": item})
    names = axis("") | {"type": "category", "data": list(rows), "inverse": True}
    drawn = plot(series, axis("difference from the common estimate (%)"), names)
    drawn["yAxis"]["axisLabel"].pop(":formatter")
    return drawn | {"tooltip": {"show": False}, "grid": drawn["grid"] | {"left": 110}}


def intervals_height(rows: int, ways: int) -> str:
    """Height of a chart of so many intervals, in CSS."""
    return f"{120 + rows * (BAR * ways + 12)}px"
