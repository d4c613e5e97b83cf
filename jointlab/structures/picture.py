"""Measured curves beside the simulation, without and with the effects of the verdict."""

from __future__ import annotations

from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.structures.curve import Curve, parts_of
from analysis.gap.structures.diagnosis import CurveDiagnosis, curve_of
from analysis.gap.structures.single_degree import POLE
from jointlab.report.plots import BLUE, GREY, MEASURED, ORANGE, figure, without_formulas

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST, COLUMNS = 9, 3
"""Curves that are drawn, the first and the last among them, and how many side by side."""
ACROSS = ("time", "frequency", "amplitude", "temperature")
"""Conditions that a curve is drawn over, the first that it has."""
UNITS = {"frequency": "frequency (Hz)", "time": "time (s)", "temperature": "temperature (degC)"}
"""Labels of conditions with a unit of their own."""
WINDOW = 300
"""Samples of a record that are drawn: its last."""
DECADE = 10.0
"""Range from which an axis is logarithmic."""


def write_picture(path: Path, found: CurveDiagnosis, curves: tuple[Curve, ...]) -> None:
    """Draw curves as SVG or PNG, by the ending of `path`."""
    unseen = {each.part for each in curves} - set(parts_of(found.model.fit.likelihood.curves))
    if all(each.observable == POLE and "amplitude" in each.conditions for each in curves):
        _draw_poles(path, found, curves, unseen)
        return
    chosen = [curves[n] for n in sorted(set(np.linspace(0, len(curves) - 1, min(MOST, len(curves))).astype(int)))]
    rows = ceil(len(chosen) / COLUMNS)
    drawn, grid = figure(rows, min(COLUMNS, len(chosen)), width=11.0, height=2.4)
    for place, (axes, curve) in enumerate(zip(grid, chosen, strict=False)):
        _draw(axes, curve, *curve_of(found, curve))
        axes.set_title(f"{curve.part}: {curve.observable}" + (" (never shown)" if curve.part in unseen else ""), size=9)
        axes.tick_params(labelsize=8)
        if place == 0:
            axes.legend(fontsize=8)
    for axes in grid[len(chosen) :]:
        axes.remove()
    without_formulas(drawn)
    drawn.savefig(path)


def _draw_poles(path: Path, found: CurveDiagnosis, curves: tuple[Curve, ...], unseen: set[str]) -> None:
    """Frequency and loss factor over amplitude, of all parts together."""
    drawn, grid = figure(1, 2, width=11.0, height=3.2)
    amplitude = np.concatenate([1e6 * each.conditions["amplitude"] for each in curves])
    hidden = np.concatenate([np.full(each.values.size, each.part in unseen) for each in curves])
    order, both = np.argsort(amplitude), [curve_of(found, each) for each in curves]
    series = [np.concatenate(each) for each in ([curve.values for curve in curves], *zip(*both, strict=True))]
    for axes, name, of in ((grid[0], "frequency (Hz)", _frequency), (grid[1], "loss factor", _loss)):
        measured, before, after = map(of, series)
        for own, mark, label in ((~hidden, MEASURED, "measured"), (hidden, "none", "measured, never shown")):
            if np.any(own):
                axes.plot(amplitude[own], measured[own], "o", color=MEASURED, mfc=mark, label=label, markersize=4)
        axes.plot(amplitude[order], before[order], "--", color=ORANGE, label="before")
        axes.plot(amplitude[order], after[order], color=BLUE, label="after")
        axes.set(xscale="log", xlabel="amplitude (µm)", ylabel=name)
        axes.xaxis.set_major_formatter("{x:g}")
    grid[0].legend(fontsize=8)
    drawn.savefig(path)


def _frequency(poles: Complex) -> Real:
    """Hz."""
    return np.asarray(poles.imag / (2 * np.pi))


def _loss(poles: Complex) -> Real:
    return np.asarray(-2 * poles.real / poles.imag)


def _draw(axes: Axes, curve: Curve, before: Complex, after: Complex) -> None:
    """A record by what is left of it, which is all that can be seen; anything else by its size."""
    name, across = _across(curve)
    axes.set_xlabel(UNITS.get(name, name), fontsize=8)
    if name == "time":
        own = slice(-WINDOW, None)
        axes.plot(across[own], curve.values[own], color=GREY, label="measured")
        axes.plot(across[own], (curve.values - before)[own], color=ORANGE, label="left before", linewidth=1)
        axes.plot(across[own], (curve.values - after)[own], color=BLUE, label="left after", linewidth=1)
        return
    marks = ("o", "x") if across.size == 1 else ("--", "-")
    axes.plot(across, _size(curve.values), ".", color=MEASURED, label="measured", markersize=4)
    axes.plot(across, _size(before), marks[0], color=ORANGE, label="before")
    axes.plot(across, _size(after), marks[1], color=BLUE, label="after")
    if across.size > 1 and np.min(across) > 0 and np.max(across) > DECADE * np.min(across):
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter("{x:g}")
    if curve.is_complex and np.max(_size(curve.values)) > DECADE * np.min(_size(curve.values)):
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter("{x:g}")


def _across(curve: Curve) -> tuple[str, Real]:
    for name in (*ACROSS, *curve.conditions):
        if name in curve.conditions:
            return name, curve.conditions[name]
    return "value", np.arange(curve.values.size, dtype=float)


def _size(values: Complex | Real) -> Real:
    return np.asarray(np.abs(values) if np.iscomplexobj(values) else values)
