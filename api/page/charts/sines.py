"""Sine points: the signals of one, the amplitudes reached, k and gamma over frequency with their intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from api.page.charts.axes import SYMBOLS, Options, Real, axis, dots, inked, line, pairs, plot, thinned
from jointlab.report.curves import Curve, Panel
from jointlab.report.plots import AMPLITUDE_COLOURS, AMPLITUDE_STYLES, BLUE, ORANGE

Values = tuple[Real, Real]
"""Frequency in Hz and value, each (points,)."""
Banded = tuple[Real, Real, Real]
"""Frequency in Hz, value and the half-width of its interval, each (points,)."""


def signals(time: Real, displacement: Real, force: Real) -> Options:
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


def amplitudes(reached: Mapping[float, Values]) -> Options:
    """Amplitude reached over amplitude asked, by the amplitude asked in mm peak to peak."""
    series = [
        dots(f"{asked:g} mm", *curve, color=colour, symbol=symbol)
        for (asked, curve), colour, symbol in zip(reached.items(), AMPLITUDE_COLOURS * 9, SYMBOLS * 9, strict=False)
    ]
    return plot(series, axis("frequency (Hz)"), axis("reached / asked"))


def over_frequency(curves: Mapping[float, Values], name: str) -> Options:
    """Something over frequency, a line for each amplitude in mm peak to peak."""
    return plot(_lines(curves), axis("frequency (Hz)"), axis(name), zoom=True)


def with_intervals(curves: Mapping[float, Banded], name: str, bands: Mapping[str, tuple[float, float]]) -> Options:
    """The same with 95 % intervals as bars, and what another method gives as `bands` across."""
    series = _lines({amplitude: (frequency, value) for amplitude, (frequency, value, _) in curves.items()})
    for (amplitude, (frequency, value, half)), colour in zip(curves.items(), AMPLITUDE_COLOURS * 9, strict=False):
        series.append(_bars(f"{amplitude:g} mm", frequency, value, half, colour))
    for (method, (low, high)), colour in zip(bands.items(), ("#0072b233", "#d55e0033"), strict=False):
        area = {"itemStyle": {"color": colour}, "data": [[{"yAxis": low}, {"yAxis": high}]]}
        series.append({"type": "line", "name": method, "data": [], "color": colour[:7], "markArea": area})
    made = plot(series, axis("frequency (Hz)"), axis(name), zoom=True)
    ends = [end for band in bands.values() for end in band]
    if ends:  # a band alone does not stretch the axis
        values = [*ends, *(float(end) for _, value, _ in curves.values() for end in (value.min(), value.max()))]
        room = 0.08 * (max(values) - min(values))
        made["yAxis"] |= {"min": float(f"{min(values) - room:.3g}"), "max": float(f"{max(values) + room:.3g}")}
    return made


def panel(drawn: Panel, name: str, scale: float = 1.0) -> Options:
    """A panel of Fig. 13 or 14: direct points with intervals by amplitude, inverse intervals across, over `scale`."""
    curves = {a: (c.frequency, c.value / scale, c.half_width / scale) for a, c in drawn.curves.items()}
    bands = {
        f"inverse, {method}": (float(low) / scale, float(high) / scale) for method, (low, high) in drawn.inverse.items()
    }
    return with_intervals(curves, name, bands)


def superposition(computed: Mapping[float, Curve], measured: Mapping[float, Curve]) -> Options:
    """Fig. 12: |k| of the angled pair, measured as lines, computed from compression and shear as marks."""
    series = []
    for (amplitude, drawn), (colour, kind), symbol in zip(
        sorted(measured.items(), reverse=True), AMPLITUDE_STYLES, SYMBOLS * 9, strict=False
    ):
        series.append(line(f"measured, {amplitude:g} mm", drawn.frequency, drawn.value / 1e6, **inked(colour, kind)))
        sums = computed[amplitude]
        mark = {"color": colour, "symbol": symbol}
        series.append(dots(f"computed, {amplitude:g} mm", sums.frequency, sums.value / 1e6, **mark))
    return plot(series, axis("frequency (Hz)"), axis("|k| (MN/m)", low=0), zoom=True)


def _lines(curves: Mapping[float, Values]) -> list[Options]:
    return [
        line(f"{amplitude:g} mm", *curve, color=colour, showSymbol=True, symbol=symbol, symbolSize=7)
        for (amplitude, curve), colour, symbol in zip(curves.items(), AMPLITUDE_COLOURS * 9, SYMBOLS * 9, strict=False)
    ]


def _bars(name: str, frequency: Real, value: Real, half: Real, colour: str) -> Options:
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


def by_amplitude(rows: Sequence[tuple[float, float, float]]) -> dict[float, Values]:
    """Rows of amplitude, frequency and value as one curve for each amplitude, over rising frequency."""
    found: dict[float, list[tuple[float, float]]] = {}
    for amplitude, frequency, value in rows:
        found.setdefault(amplitude, []).append((frequency, value))
    return {
        amplitude: (np.array([f for f, _ in sorted(points)]), np.array([v for _, v in sorted(points)]))
        for amplitude, points in sorted(found.items(), reverse=True)
    }
