"""A master curve over reduced frequency with the points behind it, and its shift factors over temperature."""

from collections.abc import Sequence

import numpy as np

from api.page.charts.axes import SYMBOLS, ChartOptions, axis, dots, line, pairs, plot
from jointlab.documents.master import Ends, MasterDocument
from jointlab.report.plots import AMPLITUDE_COLOURS, BLACK, BLUE

MEGA = 1e6
BAND = "95 %"
CURVE, LAW, SWEEPS = "curve", "by the law", "sweeps"


def magnitude(found: MasterDocument) -> ChartOptions:
    """|k| of the curve at the reference temperature with its 95 % band, and the points at their reduced frequencies."""
    points = [each.reduced_magnitude / MEGA for each in found.measured]
    curve = found.curve
    interval = [(low / MEGA, high / MEGA) for low, high in curve.magnitude_ci95]
    series = _over_frequency(found, [each / MEGA for each in curve.magnitude], interval, points)
    return plot(series, _reduced(found), axis("|k| (MN/m)", log=True), zoom=True)


def loss_factor(found: MasterDocument) -> ChartOptions:
    """Gamma in the same way; the lag is taken out of the points, as it is not in the curve."""
    points = [each.gamma_without_lag for each in found.measured]
    series = _over_frequency(found, found.curve.gamma, found.curve.gamma_ci95, points)
    return plot(series, _reduced(found), axis("γ"), zoom=True)


def shift_factors(found: MasterDocument) -> ChartOptions:
    """a_T over temperature: by the law with its 95 % band, and of each sweep with its interval."""
    law = found.shift_curve
    series = _banded(LAW, law.temperature_c, law.shift_factor, law.shift_factor_ci95, BLUE)
    at = np.array([each.temperature_c for each in found.sweeps])
    ends = np.array([each.own_shift_factor_ci95 for each in found.sweeps])
    own = np.array([each.own_shift_factor for each in found.sweeps])
    series.append(dots(SWEEPS, at, own, color=BLACK))
    broken = np.column_stack([ends, np.full(len(at), np.nan)]).ravel()
    quiet = {"tooltip": {"show": False}, "silent": True, "lineStyle": {"width": 1.5, "opacity": 0.7}}
    bars = {
        "type": "line",
        "name": SWEEPS,
        "color": BLACK,
        "showSymbol": False,
        "data": pairs(np.repeat(at, 3), broken),
    }
    series.append(bars | quiet)
    return plot(series, axis("temperature (°C)"), axis("shift factor a_T", log=True))


def _over_frequency(
    found: MasterDocument, value: Sequence[float], interval: Sequence[Ends], points: Sequence[float]
) -> list[ChartOptions]:
    series = _banded(CURVE, found.curve.reduced_frequency, value, interval, BLACK)
    # the ends of what was measured, on the curve alone
    ends = [{"xAxis": float(f"{each:.5g}")} for each in found.reduced_frequencies_covered]
    style = {"color": BLACK, "type": "dashed", "width": 1}
    series[0] |= {"markLine": {"symbol": "none", "silent": True, "label": {"show": False}, "lineStyle": style}}
    series[0]["markLine"] |= {"data": ends}
    for place, sweep in enumerate(found.sweeps):
        own = [index for index, each in enumerate(found.measured) if each.sweep == place]
        at = np.array([found.measured[index].reduced_frequency for index in own])
        mark = {"color": AMPLITUDE_COLOURS[place % len(AMPLITUDE_COLOURS)], "symbol": SYMBOLS[place % len(SYMBOLS)]}
        series.append(dots(f"{sweep.temperature_c:.1f} °C", at, np.array([points[index] for index in own]), **mark))
    return series


def _banded(
    name: str, at: Sequence[float], value: Sequence[float], interval: Sequence[Ends], colour: str
) -> list[ChartOptions]:
    """A line and the ends of its band."""
    x, ends = np.array(at), np.array(interval)
    dotted = {"color": colour, "lineStyle": {"width": 1.2, "type": "dotted"}}
    curve = line(name, x, np.array(value), color=colour, lineStyle={"width": 2})
    return [curve, *(line(BAND, x, ends[:, place], **dotted) for place in (0, 1))]


def _reduced(found: MasterDocument) -> ChartOptions:
    return axis(f"reduced frequency at {found.reference_c:g} °C (Hz)", log=True)
