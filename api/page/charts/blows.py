"""Charts of a blow, and of the average of the blows at a point so far."""

import numpy as np

from api.page.charts.axes import ChartOptions, Real, axis, frequency_axis, line, plot, thinned
from jointlab.report.plots import BLACK, BLUE, ORANGE

FORCE_SHOWN = (-0.005, 0.1)  # s around the trigger: a bounce of the hammer comes within


def force(time: Real, value: Real) -> ChartOptions:
    """Force of one blow in N over time in s from the trigger."""
    shown = (time >= FORCE_SHOWN[0]) & (time <= FORCE_SHOWN[1])
    series = line("force", *thinned(1e3 * time[shown], value[shown]), color=ORANGE)
    return plot([series], axis("time from the trigger (ms)"), axis("force (N)"), legend=False)


def response(time: Real, value: Real) -> ChartOptions:
    """Acceleration after one blow in m/s^2 over time in s from the trigger."""
    series = line("acceleration", *thinned(time, value), color=BLUE, lineStyle={"width": 1})
    return plot([series], axis("time from the trigger (s)"), axis("acceleration (m/s²)"), legend=False)


def accelerance(frequency: Real, magnitude: Real) -> ChartOptions:
    """|A| in (m/s^2)/N over frequency in Hz, of the accepted blows so far."""
    shown = magnitude > 0
    series = line("accelerance", *thinned(frequency[shown], magnitude[shown], 1600), color=BLACK)
    return plot([series], frequency_axis(frequency), axis("|A| ((m/s²)/N)", log=True), legend=False)


def coherence(frequency: Real, value: Real) -> ChartOptions:
    """Coherence of the accepted blows so far over frequency in Hz."""
    series = line("coherence", *thinned(frequency, np.clip(value, 0, 1), 1600), color=BLUE)
    return plot([series], frequency_axis(frequency), axis("coherence", low=0, high=1), legend=False)
