"""Accelerances, the stabilisation chart, mode shapes that move, and Figs. 5 and 7 to 9."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.dof import Dof
from analysis.frequency_response import FrequencyResponses
from analysis.modal.stabilisation import Stabilisation
from api.page.charts.axes import (
    INK,
    SYMBOLS,
    ChartOptions,
    Real,
    axis,
    distinct_line,
    dots,
    frequency_axis,
    line,
    line_style,
    phase_axis,
    plot,
)
from jointlab.report.plots import AMPLITUDE_COLOURS, BLACK, BLUE, CURVE_STYLES, ORANGE
from jointlab.report.section import number

Complex = NDArray[np.complex128]
SHOWN = 1  # accelerances that are shown at once; the legend shows the others
ROOM_FOR_NAMES = 72  # px, at the ends of curves
HAIRLINE = 1  # px, which browsers draw many times faster than anything wider
HEAVY: ChartOptions = {"sampling": "lttb", "zlevel": 1}
"""Options for thousands of points: on a canvas of their own they are not redrawn when the pointer moves."""
PHASES = 16  # of one cycle


def accelerances(frequency: Real, accelerance: Complex, names: Sequence[str], *, phase: bool = False) -> ChartOptions:
    """Magnitude in (m/s^2)/N or phase in degrees of each row of (rows, lines) accelerances over frequency in Hz."""
    keep = frequency > 0
    values = np.degrees(np.angle(accelerance)) if phase else np.abs(accelerance)
    scale = phase_axis() if phase else axis("|A| ((m/s²)/N)", log=True)
    return _rows(frequency[keep], values[:, keep], names, scale)


def coherences(frequency: Real, coherence: Real, names: Sequence[str]) -> ChartOptions:
    """Coherence of each row over frequency in Hz."""
    return _rows(frequency, coherence, names, axis("coherence", low=0, high=1))


def _rows(frequency: Real, values: Real, names: Sequence[str], scale: ChartOptions) -> ChartOptions:
    series = [
        line(name, frequency, row, **HEAVY, **distinct_line(index, HAIRLINE))
        for index, (name, row) in enumerate(zip(names, values, strict=True))
    ]
    made = plot(series, frequency_axis(frequency), scale, zoom=True)
    made["legend"]["selected"] = {name: index < SHOWN for index, name in enumerate(names)}
    made["grid"]["right"] = ROOM_FOR_NAMES
    return made


def stabilisation(chart: Stabilisation, frequency: Real, sum_of_rows: Real, found: Real) -> ChartOptions:
    """Poles of every model order over frequency in Hz, over the sum of all accelerances; `found` are the modes."""
    kinds = (
        ("new", ~chart.stable, "#b0b0b0", "circle", 4),
        ("stable", chart.stable & (chart.column < 0), BLUE, "emptyCircle", 5),
        ("candidate mode", chart.column >= 0, ORANGE, "triangle", 7),
    )
    series = [
        dots(
            name, chart.frequency[which], chart.order[which].astype(float), color=colour, symbol=symbol, symbolSize=size
        )
        for name, which, colour, symbol, size in kinds
    ]
    marks = [{"xAxis": round(float(each), 3)} for each in found]
    series.append(
        line("sum of accelerances", frequency, sum_of_rows, color=BLACK, yAxisIndex=1, lineStyle={"width": 1})
        | {"markLine": {"symbol": "none", "silent": True, "label": {"show": False}, "data": marks}}
    )
    made = plot(series, frequency_axis(frequency), axis("model order"), zoom=True)
    right = axis("Σ|A| ((m/s²)/N)", log=True) | {"nameGap": 56, "splitLine": {"show": False}}
    return made | {"yAxis": [made["yAxis"], right], "grid": made["grid"] | {"right": 82}}


def moving_shape(name: str, positions: Real, shape: Complex, length: float) -> str:
    """One transverse shape (points,) at `positions` in m, swinging as it does: a complex shape travels."""
    order = np.argsort(positions)
    x = 30 + 440 * positions[order] / length
    turned = shape[order] * np.exp(-1j * np.angle(shape[np.argmax(np.abs(shape))]))
    swing = turned / max(float(np.abs(turned).max()), 1e-300)
    frames = [_points(x, (swing * np.exp(2j * np.pi * k / PHASES)).real) for k in range(PHASES + 1)]
    ghost = _points(x, -swing.real)
    return (
        f'<svg viewBox="0 0 500 150" role="img" aria-label="{name}"><line x1="30" x2="470" y1="75" y2="75" '
        f'stroke="#999" stroke-dasharray="5 5"/><polyline points="{ghost}" fill="none" stroke="#bbb" stroke-width="2"/>'
        f'<polyline points="{frames[0]}" fill="none" stroke="{BLUE}" stroke-width="5" stroke-linejoin="round">'
        f'<animate attributeName="points" dur="1.6s" repeatCount="indefinite" values="{";".join(frames)}"/></polyline>'
        f'<text x="30" y="20" font-size="19" font-weight="700">{name}</text></svg>'
    )


def mode_name(index: int, frequency: float) -> str:
    """The title of a mode."""
    return f"mode {index + 1}, {number(frequency, 4)} Hz"


def _points(x: Real, y: Real) -> str:
    return " ".join(f"{a:.1f},{75 - 48 * b:.1f}" for a, b in zip(x, y, strict=True))


def regression(observed_and_fitted: Mapping[str, tuple[Real, Real]]) -> ChartOptions:
    """Fig. 5: observed over fitted side of the joint equations, for each joint."""
    span = max(float(np.abs(values).max()) for pair in observed_and_fitted.values() for values in pair)
    series = [
        dots(f"joint {name}", fitted, observed, color=colour, symbol=symbol)
        for (name, (observed, fitted)), colour, symbol in zip(
            observed_and_fitted.items(), AMPLITUDE_COLOURS * 9, SYMBOLS * 9, strict=False
        )
    ]
    ends = np.array([-span, span])
    series.append(line("slope one", ends, ends, color=INK, lineStyle={"width": 1, "type": "dashed"}))
    return plot(series, axis("curve-fitted"), axis("observed"), zoom=True)


def measured_and_predicted(
    measured: FrequencyResponses, predicted: Mapping[str, FrequencyResponses], point: Dof, *, phase: bool = False
) -> ChartOptions:
    """Figs. 7 to 9: magnitude or phase of one row, measured and as each method's joints predict it."""
    series = []
    for (name, responses), (colour, kind) in zip(
        {"measured": measured, **predicted}.items(), CURVE_STYLES, strict=False
    ):
        row, keep = responses.accelerance[responses.row(point)], responses.frequency > 0
        frequency = responses.frequency[keep]
        if phase:  # dots: a line would draw every jump from 180 to -180 degrees
            angle = np.degrees(np.angle(row[keep]))
            series.append(dots(name, frequency, angle, color=colour, symbolSize=3))
        else:
            look = line_style(colour, kind, 2 if responses is measured else 1.5)
            series.append(line(name, frequency, np.abs(row[keep]), sampling="lttb", **look))
    scale = phase_axis() if phase else axis("|A| ((m/s²)/N)", log=True)
    return plot(series, frequency_axis(measured.frequency), scale, zoom=True)


def overlaid(
    measured: Mapping[str, tuple[Real, Complex]], looks: Mapping[str, tuple[str, str]], *, phase: bool = False
) -> ChartOptions:
    """Magnitude or phase of one row by several runs: frequency in Hz, accelerance, and look by run."""
    series = []
    for name, (frequency, row) in measured.items():
        keep, (colour, kind) = frequency > 0, looks[name]
        if phase:
            series.append(dots(name, frequency[keep], np.degrees(np.angle(row[keep])), color=colour, symbolSize=3))
        else:
            look = line_style(colour, kind, 1.5)
            series.append(line(name, frequency[keep], np.abs(row[keep]), sampling="lttb", **look))
    scale = phase_axis() if phase else axis("|A| ((m/s²)/N)", log=True)
    longest = max((frequency for frequency, _ in measured.values()), key=lambda each: float(each[-1]))
    return plot(series, frequency_axis(longest), scale, zoom=True)
