"""Figs. 5 and 7 to 9: the equations of the paper's method, and accelerances measured and predicted."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from analysis.dof import Dof
from analysis.frequency_response import FrequencyResponses
from api.page.charts.axes import (
    INK,
    SYMBOLS,
    Options,
    Real,
    axis,
    dots,
    frequency_axis,
    inked,
    line,
    phase_axis,
    plot,
)
from jointlab.report.plots import AMPLITUDE_COLOURS, CURVE_STYLES


def regression(observed_and_fitted: Mapping[str, tuple[Real, Real]]) -> Options:
    """Fig. 5: what the joint equations observe over what the identified joints give, for each joint."""
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
) -> Options:
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
            look = inked(colour, kind, 2 if responses is measured else 1.5)
            series.append(line(name, frequency, np.abs(row[keep]), sampling="lttb", **look))
    scale = phase_axis() if phase else axis("|A| ((m/s²)/N)", log=True)
    return plot(series, frequency_axis(measured.frequency), scale, zoom=True)
