"""Sine points: signals, amplitudes reached, k and gamma over frequency, and intervals of both experiments."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from api.page.charts.axes import SYMBOLS, ChartOptions, Real, axis, dots, line, line_style, pairs, plot, thinned
from jointlab.report.curves import Panel, PlottedCurve
from jointlab.report.plots import AMPLITUDE_COLOURS, AMPLITUDE_STYLES, BLUE, ORANGE
from jointlab.supervision.sweep_progress import Signals
from store.results.comparisons import Comparison

SAMPLES_SHOWN = 300  # of a loop
NO_BANDS: Mapping[str, Sequence[float]] = MappingProxyType({})


def signals(time: Real, displacement: Real, force: Real) -> ChartOptions:
    """Displacement in m and force in N over time in s, as a technician's oscilloscope shows them."""
    millis = 1e3 * time
    made = plot(
        [
            line("displacement", *thinned(millis, 1e3 * displacement), color=BLUE),
            line("force", *thinned(millis, force), color=ORANGE, yAxisIndex=1),
        ],
        axis("time (ms)"),
        axis("displacement (mm)"),
    )
    right = axis("force (N)") | {"nameGap": 56, "splitLine": {"show": False}}
    return made | {"yAxis": [made["yAxis"], right], "grid": made["grid"] | {"right": 82}}


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
    curves: Mapping[float, PlottedCurve],
    name: str,
    scale: float = 1.0,
    bands: Mapping[str, Sequence[float] | Real] = NO_BANDS,
) -> ChartOptions:
    """Something over frequency: a line for each amplitude in mm peak to peak, with 95 % intervals as bars.

    Args:
        curves: by amplitude; one without intervals has no bars.
        name: of the axis, unit included.
        scale: by which values, intervals and bands are divided.
        bands: intervals across the chart that another method gives, by its name.
    """
    series: list[ChartOptions] = []
    bars: list[ChartOptions] = []
    for (amplitude, curve), colour, symbol in zip(curves.items(), AMPLITUDE_COLOURS * 9, SYMBOLS * 9, strict=False):
        title, value = f"{amplitude:g} mm", curve.value / scale
        mark = {"color": colour, "showSymbol": True, "symbol": symbol, "symbolSize": 7}
        series.append(line(title, curve.frequency, value, **mark))
        if not np.isnan(curve.half_width).all():
            bars.append(_bars(title, curve.frequency, value, curve.half_width / scale, colour))
    series += bars
    across = {method: (float(low) / scale, float(high) / scale) for method, (low, high) in bands.items()}
    for (method, (low, high)), colour in zip(across.items(), ("#0072b233", "#d55e0033"), strict=False):
        area = {"itemStyle": {"color": colour}, "data": [[{"yAxis": low}, {"yAxis": high}]]}
        series.append({"type": "line", "name": method, "data": [], "color": colour[:7], "markArea": area})
    made = plot(series, axis("frequency (Hz)"), axis(name), zoom=True)
    if across:  # a band alone does not stretch the axis
        ends = [end for band in across.values() for end in band]
        extremes = [end(curve.value) / scale for curve in curves.values() for end in (np.min, np.max)]
        values = [*ends, *map(float, extremes)]
        room = 0.08 * (max(values) - min(values))
        made["yAxis"] |= {"min": float(f"{min(values) - room:.3g}"), "max": float(f"{max(values) + room:.3g}")}
    return made


def panel(drawn: Panel, name: str, scale: float = 1.0) -> ChartOptions:
    """A panel of Fig. 13 or 14: direct points with intervals by amplitude, inverse intervals across, over `scale`."""
    return over_frequency(
        drawn.curves, name, scale, {f"inverse, {method}": interval for method, interval in drawn.inverse.items()}
    )


def superposition(computed: Mapping[float, PlottedCurve], measured: Mapping[float, PlottedCurve]) -> ChartOptions:
    """Fig. 12: |k| of the angled pair, measured as lines, computed from compression and shear as marks."""
    series = []
    for (amplitude, drawn), (colour, kind), symbol in zip(
        sorted(measured.items(), reverse=True), AMPLITUDE_STYLES, SYMBOLS * 9, strict=False
    ):
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


def intervals(compared: Sequence[Comparison], scale: float, unit: str) -> ChartOptions:
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
