"""A channel live: its latest block over time, and the mean spectrum of the latest blocks."""

import numpy as np

from api.page.charts.axes import ChartOptions, Real, axis, frequency_axis, line, plot, thinned
from api.page.formatting import UNITS
from jointlab.report.plots import BLUE, ORANGE

CHART_UNITS = {"m": ("µm", 1e-6)}
"""By SI unit, the unit that charts use instead, and its size in the SI unit."""


def trace(samples: Real, sample_rate: float, unit: str) -> ChartOptions:
    """(samples,) in `unit` over time in ms."""
    name, size = CHART_UNITS.get(unit, (UNITS.get(unit, unit), 1.0))
    time: Real = np.asarray(1e3 * np.arange(samples.size) / sample_rate, dtype=np.float64)
    return plot(
        [line("signal", *thinned(time, samples / size, 400), color=BLUE)], axis("time (ms)"), axis(name), legend=False
    )


def spectrum(frequency: Real, power: Real, unit: str) -> ChartOptions:
    """Amplitude spectral density of (lines,) power densities in unit²/Hz over frequency in Hz."""
    name, size = CHART_UNITS.get(unit, (UNITS.get(unit, unit), 1.0))
    density = np.sqrt(np.maximum(power, np.finfo(float).tiny)) / size
    drawn = [line("density", frequency, density, color=ORANGE)]
    return plot(drawn, frequency_axis(frequency), axis(f"{name}/√Hz", log=True), legend=False)
