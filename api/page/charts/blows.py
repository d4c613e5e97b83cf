"""Low charts of a blow, of the spectrum of its force, and of the average of the blows at a point so far."""

import numpy as np

from analysis.modal.force_pulse import FALLEN, ForcePulse
from api.page.charts.axes import INK, ChartOptions, Real, axis, frequency_axis, line, low, plot, thinned
from api.page.formatting import quantity
from jointlab.report.plots import BLACK, BLUE, ORANGE

BEFORE, SHORTEST, LONGEST = 0.002, 0.01, 0.1
"""Seconds of the force that are shown: before the trigger, and after it at least and at most."""
CONTACT = 0.03  # of the peak: what is above is a contact, and comes within
DEEPEST = -60.0  # dB


def force(time: Real, value: Real) -> ChartOptions:
    """Force of one blow in N over time in s from the trigger."""
    touched = time[(value > CONTACT * np.max(value)) & (time <= LONGEST)]
    end = min(LONGEST, max(SHORTEST, 1.2 * float(np.max(touched, initial=0.0))))
    shown = (time >= -BEFORE) & (time <= end)
    series = line("force", *thinned(1e3 * time[shown], value[shown]), color=ORANGE)
    return _low(series, axis("time from the trigger (ms)"), axis("force (N)"))


def spectrum(pulse: ForcePulse) -> ChartOptions:
    """Level of the force in dB over frequency in Hz, with a line where it has fallen by 20 dB."""
    shown = np.maximum(pulse.level, DEEPEST)
    marked: ChartOptions = {}
    if pulse.reach is not None:
        look = {"color": INK, "type": "dashed"}
        mark = {"symbol": "none", "silent": True, "lineStyle": look, "label": {"show": False}}
        marked = {"markLine": mark | {"data": [{"xAxis": pulse.reach}, {"yAxis": -FALLEN}]}}
    series = line("force", *thinned(pulse.frequency, shown), color=ORANGE, **marked)
    scale = axis("force (dB)", low=DEEPEST, high=0) | {"interval": 20}
    return _low(series, frequency_axis(pulse.frequency), scale)


def reach_text(pulse: ForcePulse) -> str:
    """How far the spectrum of a force reaches, in words."""
    if pulse.reach is None:
        return f"less than {FALLEN:g} dB down at {quantity(pulse.frequency[-1], 'Hz')}"
    return f"{FALLEN:g} dB down at {quantity(pulse.reach, 'Hz')}"


def response(time: Real, value: Real) -> ChartOptions:
    """Acceleration after one blow in m/s^2 over time in s from the trigger."""
    series = line("acceleration", *thinned(time, value), color=BLUE, lineStyle={"width": 1})
    return _low(series, axis("time from the trigger (s)"), axis("acceleration (m/s²)"))


def accelerance(frequency: Real, magnitude: Real) -> ChartOptions:
    """|A| in (m/s^2)/N over frequency in Hz, of the accepted blows so far."""
    shown = magnitude > 0
    series = line("accelerance", *thinned(frequency[shown], magnitude[shown], 1600), color=BLACK)
    return _low(series, frequency_axis(frequency), axis("|A| ((m/s²)/N)", log=True))


def coherence(frequency: Real, value: Real) -> ChartOptions:
    """Coherence of the accepted blows so far over frequency in Hz."""
    series = line("coherence", *thinned(frequency, np.clip(value, 0, 1), 1600), color=BLUE)
    return _low(series, frequency_axis(frequency), axis("coherence", low=0, high=1) | {"interval": 0.5})


def _low(series: ChartOptions, x: ChartOptions, y: ChartOptions) -> ChartOptions:
    return low(plot([series], x, y, legend=False))
